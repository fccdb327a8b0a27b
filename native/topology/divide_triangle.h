// SPDX-License-Identifier: GPL-3.0-or-later
/// Divides a triangle so that given points on its edges and on its inside become corners.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace tolvol {

/// A triangle with the points that are to be corners of its pieces. Numbers are places in `points`.
struct TriangleToDivide {
  std::vector<glm::dvec3> points;
  glm::uvec3 corners;                 ///< of the triangle
  std::vector<std::uint32_t> border;  ///< the corners and the points on the edges, around the triangle from corner x on
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;  ///< that have to be edges of pieces
};

/// Returns pieces that have all points as corners and look to the side of the triangle, or nothing if a piece would be
/// lower than `height` or turned by more than 25 degrees, or if the edges cross. The points may lie beside the edges
/// and the plane of the triangle by rounding. The pieces are those of a constrained Delaunay triangulation in the view
/// along an axis. They depend on the order of the points, but not on which corner is the first, nor on the side of the
/// triangle. O(n log n).
std::optional<std::vector<glm::uvec3>> divide(const TriangleToDivide& triangle, double height);

}  // namespace tolvol
