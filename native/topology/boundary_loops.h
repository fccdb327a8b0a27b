// SPDX-License-Identifier: GPL-3.0-or-later
/// The loops in which the open edges of a mesh run around its holes.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"

namespace tolvol {

/// A run of open edges, each of which begins at the place where the one before ends.
struct BoundaryLoop {
  /// The open edges as sides of their triangles (topology/sides.h), in the direction of the triangles, so that the hole
  /// lies to the right as seen from the front. The lowest side of a loop that is closed comes first; one that is not
  /// begins with the edge that no other leads to.
  std::vector<std::uint32_t> sides;
  /// Tells whether the last edge ends where the first begins. Open edges that lead to an edge of more than two
  /// triangles, or to a triangle of the other orientation, form no loop.
  bool closed;
};

/// Returns the boundary loops in the order of their lowest sides. `place` names for each vertex the first vertex at its
/// position (weld_equal_positions()): an edge is open if it is the edge of one triangle only, by position. Triangles
/// with two corners at one place do not count, nor do triangles that run through the same three places as an earlier
/// one in the same direction.
///
/// A loop that comes to a vertex where several holes meet goes on along the border of the hole that it came along:
/// through the gap between two fans of triangles, in their order around the mean normal of the vertex. A loop may
/// therefore pass a vertex twice, where an island inside of a hole touches its rim. `positions` are those of the
/// vertices or any affine image of them. O(n + m log m). The same on any number of threads.
std::vector<BoundaryLoop> boundary_loops(std::span<const glm::dvec3> positions, std::span<const std::uint32_t> place,
                                         std::span<const glm::uvec3> triangles, Team& team);

}  // namespace tolvol
