// SPDX-License-Identifier: GPL-3.0-or-later
/// The sides of triangles, and which of them are on one edge. A side is the edge of triangle side / 3 from corner
/// side % 3 to the next, so that it has the number of the corner at its start.
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "base/call.h"
#include "base/default_init.h"
#include "base/parallel.h"
#include "topology/sort_by.h"

namespace tolvol {

using Side = std::uint32_t;

/// Return the next or the previous corner of the same triangle, and so the side there.
inline Side next_corner(Side corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
inline Side previous_corner(Side corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

/// Returns one key for a pair of numbers in either order.
inline std::uint64_t pair_key(std::uint32_t a, std::uint32_t b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) | std::max(a, b);
}

/// Calls visit() once for each set of sides with the same two ends, and hands it the sides in ascending order.
/// end_of(corner) is the vertex of a corner, a number below `vertices`.
template <class EndOf, class Visit>
void by_ends(std::span<const Side> sides, std::size_t vertices, Team& team, EndOf&& end_of, Visit&& visit) {
  struct Keyed {
    std::uint64_t ends;
    Side side;
    auto operator<=>(const Keyed&) const = default;
  };
  Unfilled<Keyed> sorted(sides.size());
  team.run(sides.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      sorted[i] = {pair_key(end_of(sides[i]), end_of(next_corner(sides[i]))), sides[i]};
    }
  });
  sort_by(
      sorted, vertices, team, [](const Keyed& s) { return s.ends >> 32; }, std::less<Keyed>());
  std::vector<Side> alike;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    poll_at(i);
    alike.push_back(sorted[i].side);
    if (i + 1 < sorted.size() && sorted[i + 1].ends == sorted[i].ends) continue;
    visit(std::as_const(alike));
    alike.clear();
  }
}

}  // namespace tolvol
