// SPDX-License-Identifier: GPL-3.0-or-later
/// A counting sort on several threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/call.h"
#include "base/parallel.h"

namespace tolvol {

/// Calls place(i, at) for each i below `count`, where `at` is the place of i once all are sorted by group_of(i), which
/// is below `groups`. Those of one group stay in their order, on any number of threads. Returns where each group
/// begins, and, at the end, `count`. O(count + groups * threads); `count` is below 2^32.
template <class GroupOf, class Place>
std::vector<std::uint32_t> distribute(std::size_t count, std::size_t groups, Team& team, GroupOf&& group_of,
                                      Place&& place) {
  constexpr std::size_t kOfPart = 20'000;  // A thread that had fewer would cost more time than it saves.
  // Each part has its own places in each group, so that no two threads write to one place.
  const std::size_t parts = std::min(team.size(), 1 + count / kOfPart);
  std::vector<std::vector<std::uint32_t>> next(parts, std::vector<std::uint32_t>(groups));
  const auto for_each = [&](auto&& use) {
    team.run(parts, 1, [&](std::size_t part, std::size_t) {
      std::vector<std::uint32_t>& of_part = next[part];
      for (std::size_t i = count * part / parts; i < count * (part + 1) / parts; ++i) {
        poll_at(i);
        use(i, of_part[group_of(i)]);
      }
    });
  };
  for_each([](std::size_t, std::uint32_t& counted) { ++counted; });
  std::uint32_t before = 0;
  std::vector<std::uint32_t> begin(1, 0);
  for (std::size_t group = 0; group < groups; ++group) {
    for (auto& of_part : next) before += std::exchange(of_part[group], before);
    begin.push_back(before);
  }
  for_each([&](std::size_t i, std::uint32_t& free) { place(i, free++); });
  return begin;
}

}  // namespace tolvol
