// SPDX-License-Identifier: GPL-3.0-or-later
/// Bounds on the distance from a mesh over a whole point, segment or triangle, and on the mean distance there.
#pragma once

#include <algorithm>
#include <array>
#include <glm/glm.hpp>

#include "geometry/hierarchy.h"

namespace tolvol {

struct Range {
  double lower = 0, upper = 0;
};

/// The convex hull of the first `corners` of three points: a point for 1, a segment for 2, a triangle for 3.
struct Simplex {
  std::array<glm::dvec3, 3> corner{};
  int corners = 3;

  glm::dvec3 centroid() const;
};

struct DistanceBounds {
  std::uint32_t nearest;                   ///< is the triangle of b nearest to the centroid
  std::uint32_t steps = 0;                 ///< counts the nodes of the hierarchy and triangles that were looked at
  Range value, mean, mean_square;          ///< are of the distance over the piece
  std::array<double, 3> lower{}, upper{};  ///< at the corners: the linear functions of these values bound the distance
  std::array<Range, 4> quarters{};         ///< are of the distance over four equal parts of the piece, in no order

  /// Returns the largest difference of the two functions.
  double room(int corners) const {
    double most = 0;
    for (int i = 0; i < corners; ++i) most = std::max(most, upper[i] - lower[i]);
    return most;
  }
};

/// Returns bounds on the distance from the points of `piece` to the mesh b of `hierarchy`, both in a frame where |x| <=
/// 1. The ranges are widened by the largest rounding error, so that lower < upper. Their width is of the order of the
/// length of the piece times the angle between the two surfaces near it. `hint` is a triangle of b that may be near, or
/// Hierarchy::kNone; it does not change the result. A call costs 2 to 15 us.
DistanceBounds distance_bounds(const Simplex& piece, const TriangleMesh& b, const Hierarchy& hierarchy,
                               std::uint32_t hint);

/// The same from one point of the piece alone, without a search: `nearest` is known for that point, and the distance
/// changes by at most the way to another point. The ranges are as wide as the piece is long.
DistanceBounds bounds_around(const glm::dvec3& point, const Hierarchy::Nearest& nearest, const Simplex& piece,
                             const TriangleMesh& b);

}  // namespace tolvol
