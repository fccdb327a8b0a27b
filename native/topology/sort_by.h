// SPDX-License-Identifier: GPL-3.0-or-later
/// Sorts things of which a mesh has few at each vertex, such as sides and triangles.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "base/call.h"
#include "base/parallel.h"

namespace tolvol {

/// Sorts things by `before`, which must compare first(thing), a number below `groups`, before anything else. One pass
/// sorts by this number, and short sorts order the few things that share it. Each thread looks at all things and places
/// those of a range of groups, about as many as the other threads.
template <class T, class Allocator, class First, class Before>
void sort_by(std::vector<T, Allocator>& things, std::size_t groups, Team& team, First&& first, Before&& before) {
  if (things.size() < 2) return;
  const std::size_t ranges = team.size();
  std::vector<std::size_t> border(ranges + 1);
  for (std::size_t i = 0; i <= ranges; ++i) border[i] = groups * i / ranges;
  const auto in_ranges = [&](auto&& body) {
    team.run(ranges, 1, [&](std::size_t i, std::size_t) { body(border[i], border[i + 1]); });
  };
  std::vector<std::uint32_t> end(groups + 1, 0);
  in_ranges([&](std::size_t lower, std::size_t upper) {
    for (const T& t : things) {
      if (const std::size_t group = first(t); lower <= group && group < upper) ++end[group + 1];
    }
  });
  std::partial_sum(end.begin(), end.end(), end.begin());
  for (std::size_t i = 1; i < ranges; ++i) {
    const auto share = static_cast<std::uint32_t>(things.size() * i / ranges);
    border[i] = static_cast<std::size_t>(std::lower_bound(end.begin(), end.end() - 1, share) - end.begin());
  }
  std::vector<T, Allocator> sorted(things.size());
  in_ranges([&](std::size_t lower, std::size_t upper) {
    if (lower == upper) return;  // end[lower] belongs to another thread
    const auto at = [&](std::uint32_t i) { return sorted.begin() + static_cast<std::ptrdiff_t>(i); };
    std::uint32_t begin = end[lower];
    for (const T& t : things) {
      if (const std::size_t group = first(t); lower <= group && group < upper) sorted[end[group]++] = t;
    }
    for (std::size_t group = lower; group < upper; begin = end[group++]) {
      poll_at(group);
      std::sort(at(begin), at(end[group]), before);
    }
  });
  things.swap(sorted);
}

}  // namespace tolvol
