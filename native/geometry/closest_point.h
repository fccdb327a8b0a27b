// SPDX-License-Identifier: GPL-3.0-or-later
/// The point of a triangle that is nearest to a given point.
#pragma once

#include <glm/glm.hpp>

namespace tolvol {

struct ClosestPoint {
  glm::dvec3 point;    ///< is the witness, weights.x * a + weights.y * b + weights.z * c, up to rounding
  glm::dvec3 weights;  ///< are barycentric and at least 0, and their sum is 1 up to rounding
  double
      distance_squared;  ///< is |p - point|^2, from `point` itself and never from a plane equation, so that it is the
                         /// < distance to a point of the triangle even for needles and degenerate triangles
};

/// Returns the nearest point after C. Ericson, Real-Time Collision Detection, 2005, §5.1.5, made safe for degenerate
/// triangles, which count as the segments or points that they are. The corners must be finite. If p is not finite, the
/// distance is not finite either. O(1).
ClosestPoint closest_point(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

/// Returns true only if closest_point(p, a, b, c).distance_squared is above `squared`, which the plane of the triangle
/// or the plane across it through the longest edge shows at a fraction of the cost. It may return false then too: if
/// the other edges and the corners decide, if the triangle is nearly degenerate, and if the difference is within
/// rounding of the coordinates. O(1).
bool is_beyond(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double squared);

/// Where the dot products of p - a with b - a and with c - a are both below minus this, closest_point(p, a, b, c) is
/// exactly a, and so it is for any order of the corners. No coordinate may be larger than `size`.
double corner_noise(double size);

}  // namespace tolvol
