// SPDX-License-Identifier: GPL-3.0-or-later
/// Bounds on the distance to a mesh over a whole point, segment or triangle, and on its mean there.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "geometry/hierarchy.h"

namespace tolvol {

struct Range {
  double lower = 0, upper = 0;
};

/// The convex hull of the first `corners` of three points: 1 a point, 2 a segment, 3 a triangle.
struct Simplex {
  std::array<glm::dvec3, 3> corner{};
  int corners = 3;

  glm::dvec3 centroid() const;
};

struct DistanceBounds {
  std::uint32_t nearest;           ///< the triangle of b nearest to the centroid
  std::uint32_t steps = 0;         ///< nodes of the hierarchy and triangles that were looked at: what the bounds cost
  Range value, mean, mean_square;  ///< of the distance over the piece
};

/// What holds of the distance from the points of `piece` to the mesh b of `hierarchy`, both in a frame where |x| <= 1:
/// the ranges are widened by what rounding may have done to them, so that lower < upper. They are narrower than the
/// piece is long by one order: by the product of its length and the angle between the two surfaces near it. `hint`: a
/// triangle of b that may be near, or Hierarchy::kNone; it does not change the result. Cost: 2 to 10 us.
DistanceBounds distance_bounds(const Simplex& piece, const TriangleMesh& b, const Hierarchy& hierarchy,
                               std::uint32_t hint);

/// The same from what is known of one point of the piece alone, without a search: `nearest` is found there, and the
/// distance falls by at most the way to another point. The ranges are as wide as the piece is long.
DistanceBounds bounds_around(const glm::dvec3& point, const Hierarchy::Nearest& nearest, const Simplex& piece,
                             const TriangleMesh& b);

}  // namespace tolvol
