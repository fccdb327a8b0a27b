// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/separation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/closest_point.h"

namespace tolvol {
namespace {

/// A sheet is beside a face if the direction to it is as far from the face's normal as this cosine, or farther.
constexpr double kSideCosine = 0.5;

double cross(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

/// A triangle in a view along a direction: the corners in the plane of the view, and how far each is along the
/// direction.
struct View {
  View(const Corners& t, const glm::dvec3& right, const glm::dvec3& up, const glm::dvec3& direction) {
    for (int k = 0; k < 3; ++k) {
      corners[k] = {glm::dot(right, t[k]), glm::dot(up, t[k])};
      heights[k] = glm::dot(direction, t[k]);
    }
    area = cross(corners[1] - corners[0], corners[2] - corners[0]);
  }
  glm::dvec3 weights(const glm::dvec2& p) const {
    const double y = cross(p - corners[0], corners[2] - corners[0]) / area;
    const double z = cross(corners[1] - corners[0], p - corners[0]) / area;
    return {1 - y - z, y, z};
  }

  glm::dvec2 corners[3];
  glm::dvec3 heights;
  double area;  ///< twice the signed area in the view
};

/// Leaves the part of a convex polygon that is to the left of the line from a to b, or to the right if `right`. After
/// I. Sutherland and G. Hodgman, "Reentrant polygon clipping", 1974.
void clip(std::vector<glm::dvec2>& polygon, const glm::dvec2& a, const glm::dvec2& b, bool right) {
  std::vector<glm::dvec2> left;
  const auto side = [&](const glm::dvec2& p) { return (right ? -1 : 1) * cross(b - a, p - a); };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const glm::dvec2 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double at_p = side(p), at_q = side(q);
    if (at_p >= 0) left.push_back(p);
    if ((at_p < 0) != (at_q < 0)) left.push_back(p + at_p / (at_p - at_q) * (q - p));
  }
  polygon = std::move(left);
}

/// The unit normal of `other` that points to the side where the sheet is, or 0 if there is none.
glm::dvec3 side(const Corners& face, const Corners& other, std::span<const Corners> sheet) {
  const glm::dvec3 middle = (face[0] + face[1] + face[2]) / 3.0;
  const glm::dvec3 start = closest_point(middle, other[0], other[1], other[2]).point;
  double least = std::numeric_limits<double>::infinity();
  glm::dvec3 toward(0);
  for (const Corners& t : sheet) {
    const ClosestPoint found = closest_point(start, t[0], t[1], t[2]);
    if (found.distance_squared < least) least = found.distance_squared, toward = found.point - start;
  }
  const glm::dvec3 normal = glm::cross(other[1] - other[0], other[2] - other[0]);
  const double along = glm::dot(normal, toward), length = glm::length(normal);
  if (!(std::abs(along) > kSideCosine * length * glm::length(toward))) return glm::dvec3(0);
  return (along > 0 ? 1 : -1) / length * normal;
}

bool share_a_corner(const Corners& a, const Corners& b) {
  return std::ranges::any_of(a, [&](const glm::dvec3& p) { return std::ranges::find(b, p) != b.end(); });
}

}  // namespace

void separate(const Corners& face, const Corners& other, std::span<const Corners> sheet, double reach,
              std::vector<Separation>& found) {
  if (share_a_corner(face, other)) return;
  const glm::dvec3 normal = side(face, other, sheet);
  if (normal == glm::dvec3(0)) return;
  const glm::dvec3 axis = std::abs(normal.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 right = glm::normalize(glm::cross(axis, normal)), up = glm::cross(normal, right);
  const View own(face, right, up, normal), beyond(other, right, up, normal);
  if (own.area == 0 || beyond.area == 0) return;
  std::vector<glm::dvec2> overlap(own.corners, own.corners + 3);
  for (int k = 0; k < 3; ++k) clip(overlap, beyond.corners[k], beyond.corners[(k + 1) % 3], beyond.area < 0);
  for (const glm::dvec2& p : overlap) {
    const glm::dvec3 weights = own.weights(p);
    const double offset = glm::dot(beyond.weights(p), beyond.heights);
    if (glm::dot(weights, own.heights) - offset < reach) found.push_back({weights, normal, offset});
  }
}

}  // namespace tolvol
