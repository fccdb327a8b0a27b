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

/// A vertex that lies on an edge between its ends, or on the inside of a triangle.
struct TJunction {
  std::uint32_t vertex;
  glm::uvec3 on;  ///< the corners of the triangle; of an edge the ends, where the last two are equal

  bool on_edge() const { return on.y == on.z; }
};

/// How far from an edge or a triangle a vertex may lie that rounding has put there, in units of `unit` * the largest
/// coordinate of the points concerned.
inline constexpr double kTJunctionUnits = 4;

struct TJunctions {
  std::vector<TJunction> vertices;  ///< may name one contact more than once
  /// The ends of open edges that lie across other edges, and the ends of these. Both ends of such an open edge touch
  /// something: they are vertices of T-junctions, or at the place of a vertex of another sheet, but at no place with
  /// more than a hundred vertices.
  std::vector<std::uint32_t> across;

  bool empty() const { return vertices.empty() && across.empty(); }
};

/// Finds the T-junctions of a mesh. Either the vertex is at an open edge, or the edge that it lies on is open. `open`
/// are the open edges, as pairs of vertices. A vertex lies on an edge or a triangle if it is as near as the rounding of
/// coordinates may have put it: within kTJunctionUnits * `unit` * the largest coordinate of the points concerned, where
/// `unit` is half the distance from 1 to the next number. A coordinate counts up to eight times the larger one of the
/// vertex's own and the usual one, the median over the vertices, so that a few vertices far away neither cost time nor
/// hold others. A vertex that is as near to an end of the edge or to a corner is at no T-junction there. Neither is one
/// that is joined to both ends by triangles that are no more than segments, nor one whose faces all lie in the plane of
/// the face that it is on, as the faces of a decal do. O(n log n), about 0.2 us a triangle and 2 us an open edge;
/// nothing without open edges.
TJunctions find_t_junctions(TriangleMesh mesh, std::span<const glm::uvec2> open, double unit, Team& team);

/// The vertices that hold the T-junctions together, in rising order: those that lie on edges and triangles, the ends of
/// these edges and the corners of these triangles, the ends of edges that lie across each other, and all vertices at
/// the same places. Costs as find_t_junctions().
std::vector<std::uint32_t> t_junctions(TriangleMesh mesh, std::span<const glm::uvec2> open, double unit, Team& team);

}  // namespace tolvol
