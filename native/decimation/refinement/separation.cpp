// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/separation.h"

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

/// The overlap of two triangles in a view along the normal of the second.
struct Overlap {
  Overlap(const Corners& face, const Corners& other, const glm::dvec3& normal)
      : Overlap(face, other, normal, right_of(normal)) {}

  bool empty() const { return polygon.empty(); }

  View own, beyond;
  std::vector<glm::dvec2> polygon;

 private:
  Overlap(const Corners& face, const Corners& other, const glm::dvec3& normal, const glm::dvec3& right)
      : own(face, right, glm::cross(normal, right), normal), beyond(other, right, glm::cross(normal, right), normal) {
    if (own.area == 0 || beyond.area == 0) return;
    polygon.assign(own.corners, own.corners + 3);
    for (int k = 0; k < 3; ++k) clip(polygon, beyond.corners[k], beyond.corners[(k + 1) % 3], beyond.area < 0);
  }

  static glm::dvec3 right_of(const glm::dvec3& normal) {
    const glm::dvec3 axis = std::abs(normal.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    return glm::normalize(glm::cross(axis, normal));
  }
};

double squared_distance(const glm::dvec3& p, const Box& box) {
  const glm::dvec3 d = glm::max(glm::max(box.lower - p, p - box.upper), 0.0);
  return glm::dot(d, d);
}

/// Returns the way from `start` to the nearest point of the sheet, and counts the faces that it measures. Only a face
/// whose box is nearer than the nearest point so far is measured, the one with the nearest box first.
glm::dvec3 way_to(const Sheet& sheet, const glm::dvec3& start, std::size_t& measured) {
  std::size_t first = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sheet.boxes.size(); ++i) {
    const double away = squared_distance(start, sheet.boxes[i]);
    if (away < least) least = away, first = i;
  }
  least = std::numeric_limits<double>::infinity();
  glm::dvec3 way(0);
  const auto measure = [&](const Corners& t) {
    ++measured;
    const ClosestPoint found = closest_point(start, t[0], t[1], t[2]);
    if (found.distance_squared < least) least = found.distance_squared, way = found.point - start;
  };
  if (!sheet.faces.empty()) measure(sheet.faces[first]);
  for (std::size_t i = 0; i < sheet.faces.size(); ++i) {
    if (i != first && squared_distance(start, sheet.boxes[i]) < least) measure(sheet.faces[i]);
  }
  return way;
}

bool share_a_corner(const Corners& a, const Corners& b) {
  return std::ranges::any_of(a, [&](const glm::dvec3& p) { return std::ranges::find(b, p) != b.end(); });
}

}  // namespace

std::size_t separate(const Corners& face, const Corners& other, const Sheet& sheet, double reach,
                     std::vector<Separation>& found) {
  std::size_t measured = 0;
  if (share_a_corner(face, other)) return measured;
  const glm::dvec3 across = glm::cross(other[1] - other[0], other[2] - other[0]);
  const double length = glm::length(across);
  if (!(length > 0)) return measured;
  glm::dvec3 normal = across / length;
  // The overlap is computed first, because it costs less than the side, and few faces near each other overlap.
  Overlap overlap(face, other, normal);
  if (overlap.empty()) return measured;

  const glm::dvec3 middle = (face[0] + face[1] + face[2]) / 3.0;
  const glm::dvec3 start = closest_point(middle, other[0], other[1], other[2]).point;
  const glm::dvec3 way = way_to(sheet, start, measured);
  const double along = glm::dot(normal, way);
  if (!(std::abs(along) > kSideCosine * glm::length(way))) return measured;
  if (along < 0) normal = -normal, overlap = Overlap(face, other, normal);
  for (const glm::dvec2& p : overlap.polygon) {
    const glm::dvec3 weights = overlap.own.weights(p);
    const double offset = glm::dot(overlap.beyond.weights(p), overlap.beyond.heights);
    if (glm::dot(weights, overlap.own.heights) - offset < reach) found.push_back({weights, normal, offset});
  }
  return measured;
}

}  // namespace tolvol
