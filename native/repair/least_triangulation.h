// SPDX-License-Identifier: GPL-3.0-or-later
/// Fills a closed polygon in space with triangles between its corners.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace tolvol {

/// Tells which triangles and which edges between them a triangulation may have, by the numbers of the corners, in
/// rising order. Each triangle is asked about once at most, and each edge.
struct TriangulationRules {
  std::function<bool(std::uint32_t, std::uint32_t)> admits_edge;
  std::function<bool(const glm::uvec3&)> admits_triangle;
};

/// Returns the triangulation with the least sum of area * (a^2 + b^2 + c^2), a to c the sides of a triangle, among
/// those whose triangles and inner edges are all admitted; nothing if there is none. In a plane this is the Delaunay
/// triangulation of the polygon, and in space it prefers small areas and short edges. Ties go to the lower corner. The
/// n - 2 triangles have the numbers of their corners in rising order. `corners` must be at least three, and finite.
///
/// The sum of a part of the polygon is that of a triangle at its inner edge and of the two parts beyond the triangle
/// (G. T. Klincsek, "Minimal triangulations of polygonal domains", 1980; for holes: G. Barequet, M. Sharir, "Filling
/// gaps in the boundary of a polyhedron", 1995). That the sum is least for Delaunay triangulations is from V. T. Rajan,
/// "Optimality of the Delaunay triangulation in R^d", 1994. O(n^3), about 5 ns a step. Where all is admitted it asks
/// O(n^2) questions; where edges are admitted and nearly all triangles refused, O(n^3). 12 bytes * n^2 / 2. Polls.
std::vector<glm::uvec3> least_triangulation(std::span<const glm::dvec3> corners, const TriangulationRules& rules);

}  // namespace tolvol
