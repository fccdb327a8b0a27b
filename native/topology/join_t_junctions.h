// SPDX-License-Identifier: GPL-3.0-or-later
/// Puts vertices into the edges and triangles that they lie on, so that the faces that meet in a T-junction have a
/// vertex in common, and go on to meet when it moves.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "topology/t_junctions.h"

namespace tolvol {

struct JoinedMesh {
  /// The triangles of the mesh, with its vertices. One that was divided has a piece in its place and others at the end.
  std::vector<glm::uvec3> triangles;
  std::vector<std::uint32_t> parent;  ///< for each triangle, the triangle of the mesh that it is or is a piece of
  std::vector<bool> is_piece;         ///< tells for each triangle whether it is no more than a piece of its parent
  std::size_t count = 0;              ///< the places at which vertices were put into edges and triangles
};

/// Divides all triangles at an edge so that the vertex of a T-junction on it becomes their corner, and a triangle so
/// that vertices on its inside do. Edges of other faces that lie on the triangle become edges of pieces. An edge or a
/// triangle stays whole if a piece would be turned or lower than 16 times what rounding does to its corners, if an edge
/// of another face runs on beyond the triangle between its corners, or if there would be more pairs of faces that cross
/// (topology/faces_cross.h) than there were. Positions are as they are stored; `unit` is as in find_t_junctions().
/// Returns nothing if all stay whole. The same on any number of threads. About 1 us a triangle, and 10 us for one that
/// is divided.
std::optional<JoinedMesh> join_t_junctions(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                                           std::span<const TJunction> junctions, double unit, Team& team);

}  // namespace tolvol
