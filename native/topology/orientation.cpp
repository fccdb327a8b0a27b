// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/orientation.h"

#include <numeric>

#include "topology/sides.h"

namespace tolvol {

Orientation orientation(std::span<const glm::uvec3> triangles, std::size_t vertices, Team& team) {
  constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  const auto end_of = [&](Side corner) { return triangles[corner / 3][static_cast<int>(corner % 3)]; };
  std::vector<Side> sides;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const glm::uvec3& c = triangles[t];
    if (c.x != c.y && c.y != c.z && c.z != c.x) sides.insert(sides.end(), {3 * t, 3 * t + 1, 3 * t + 2});
  }
  std::vector<Side> mates(3 * triangles.size(), kNone);
  by_ends(sides, vertices, team, end_of, [&](const std::vector<Side>& alike) {
    if (alike.size() == 2) mates[alike[0]] = alike[1], mates[alike[1]] = alike[0];
  });
  Orientation result{std::vector<std::uint32_t>(triangles.size(), kNone), std::vector<bool>(triangles.size(), false)};
  std::vector<std::uint32_t> found;
  for (std::uint32_t first = 0; first < triangles.size(); ++first) {
    if (result.part[first] != kNone) continue;
    result.part[first] = first;
    found.assign(1, first);
    while (!found.empty()) {
      const std::uint32_t t = found.back();
      found.pop_back();
      for (Side side = 3 * t; side < 3 * t + 3; ++side) {
        const Side mate = mates[side];
        if (mate == kNone || result.part[mate / 3] != kNone) continue;
        result.part[mate / 3] = first;
        result.reversed[mate / 3] = result.reversed[t] != (end_of(side) == end_of(mate));
        found.push_back(mate / 3);
      }
      poll_at(t);
    }
  }
  return result;
}

}  // namespace tolvol
