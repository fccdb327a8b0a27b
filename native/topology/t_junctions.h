// SPDX-License-Identifier: GPL-3.0-or-later
/// T-junctions of a mesh: vertices of open edges that lie on other edges or on the inside of faces, and vertices inside
/// a sheet that lie on open edges of another one. The faces there meet, but share no edge or vertex.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// The vertices that hold the T-junctions together, in rising order: those that lie on an edge between its ends or on
/// the inside of a triangle, these ends and the triangle's corners, and all vertices at the same places. Either the
/// vertex is at an open edge, or the edge that it lies on is open. `open` are the open edges, as pairs of vertices. A
/// vertex lies on an edge or a triangle if it is as near as the rounding of coordinates may have put it: within 4 *
/// `unit` * the largest coordinate of the points concerned, where `unit` is half the distance from 1 to the next
/// number. A coordinate counts up to eight times the larger one of the vertex's own and the usual one, the median over
/// the vertices, so that a few vertices far away neither cost time nor hold others. A vertex that is as near to an end
/// of the edge or to a corner is at no T-junction there. Neither is one that is joined to both ends by triangles that
/// are no more than segments, nor one whose faces all lie in the plane of the face that it is on, as the faces of a
/// decal do. O(n log n), about 0.2 us a triangle and 2 us an open edge; nothing without open edges.
std::vector<std::uint32_t> t_junctions(TriangleMesh mesh, std::span<const glm::uvec2> open, double unit, Team& team);

}  // namespace tolvol
