// SPDX-License-Identifier: GPL-3.0-or-later
/// The point of a triangle that is nearest to a given point.
#pragma once

#include <glm/glm.hpp>

namespace tolvol {

struct ClosestPoint {
  glm::dvec3 point;         ///< the witness: weights.x * a + weights.y * b + weights.z * c, up to rounding
  glm::dvec3 weights;       ///< barycentric, all >= 0, their sum 1 up to rounding
  double distance_squared;  ///< |p - point|^2, from `point` itself and never from a plane equation: on needles and
                            ///< degenerate triangles it is still the distance to a point of the triangle
};

/// Degenerate triangles are the segments or points they are. The corners are finite; of a p that is
/// not, the distance is not finite either. O(1).
/// After C. Ericson, Real-Time Collision Detection, 2005, §5.1.5, made safe for degenerate input.
ClosestPoint closest_point(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);

/// True only where closest_point(p, a, b, c).distance_squared is above `squared`, as the plane of the triangle or the
/// one across it through the longest edge shows at a fraction of the cost. It may be false there too: for what the
/// other edges and the corners decide, for a triangle that is nearly degenerate, and where the difference is within
/// rounding of the coordinates. O(1).
bool is_beyond(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double squared);

}  // namespace tolvol
