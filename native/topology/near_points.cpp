// SPDX-License-Identifier: GPL-3.0-or-later
// A box and a triangle are apart if their shadows on some line are, whatever line that is. If they are apart, it is so
// on one of 13: the box's axes, the triangle's normal, and what is across an axis and an edge (S. Gottschalk, M. C.
// Lin, D. Manocha, "OBBTree", 1996).
#include "topology/near_points.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <span>
#include <vector>

#include "base/call.h"

namespace tolvol {
namespace {

/// A bound on the rounding of a shadow on a line, for coordinates up to 2.
constexpr double kShadowRounding = 1e-14;
/// So few triangles are not told apart any more.
constexpr std::size_t kFew = 16;

using Visit = std::function<void(std::uint32_t point, std::span<const std::uint32_t> triangles)>;

class Division {
 public:
  Division(std::span<const glm::dvec3> points, std::span<const double> reach, const TriangleMesh& mesh,
           const Visit& visit)
      : points_(points), reach_(reach), mesh_(mesh), visit_(visit) {}

  void divide(std::span<std::uint32_t> points, std::span<const std::uint32_t> triangles) {
    Box box;
    double reach = 0;
    for (const std::uint32_t p : points) box.add(points_[p]), reach = std::max(reach, reach_[p]);
    const glm::dvec3 centre = 0.5 * (box.lower + box.upper);
    const glm::dvec3 half = 0.5 * (box.upper - box.lower) + (reach + kShadowRounding);
    std::vector<std::uint32_t> near;
    for (const std::uint32_t t : triangles) {
      poll_at(++compared_);
      if (!are_apart(mesh_.triangles[t], centre, half)) near.push_back(t);
    }
    if (points.size() == 1 || near.size() <= kFew) {
      for (const std::uint32_t p : points) visit_(p, near);
      return;
    }
    const int axis = half.x >= half.y && half.x >= half.z ? 0 : half.y >= half.z ? 1 : 2;
    const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
    std::nth_element(points.begin(), middle, points.end(), [&](std::uint32_t a, std::uint32_t b) {
      return points_[a][axis] != points_[b][axis] ? points_[a][axis] < points_[b][axis] : a < b;
    });
    divide({points.begin(), middle}, near);
    divide({middle, points.end()}, near);
  }

 private:
  /// Whether the triangle is surely apart from the box.
  bool are_apart(const glm::uvec3& triangle, const glm::dvec3& centre, const glm::dvec3& half) const {
    glm::dvec3 corners[3];
    for (int k = 0; k < 3; ++k) corners[k] = mesh_.vertices[triangle[k]] - centre;
    const auto are_apart_on = [&](const glm::dvec3& line) {
      const double a = glm::dot(line, corners[0]), b = glm::dot(line, corners[1]), c = glm::dot(line, corners[2]);
      const double of_box = glm::dot(half, glm::abs(line));
      return std::min({a, b, c}) > of_box || std::max({a, b, c}) < -of_box;
    };
    const glm::dvec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const glm::dvec3 edges[3] = {corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]};
    for (const glm::dvec3& axis : axes) {
      if (are_apart_on(axis)) return true;
    }
    if (are_apart_on(glm::cross(edges[0], edges[1]))) return true;
    for (const glm::dvec3& axis : axes) {
      for (const glm::dvec3& edge : edges) {
        if (are_apart_on(glm::cross(axis, edge))) return true;
      }
    }
    return false;
  }

  std::span<const glm::dvec3> points_;
  std::span<const double> reach_;
  const TriangleMesh& mesh_;
  const Visit& visit_;
  std::size_t compared_ = 0;
};

}  // namespace

void for_each_near(std::span<const glm::dvec3> points, std::span<const double> reach, const TriangleMesh& mesh,
                   const Visit& visit) {
  if (points.empty()) return;
  std::vector<std::uint32_t> all(points.size()), triangles(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  std::iota(triangles.begin(), triangles.end(), 0u);
  Division(points, reach, mesh, visit).divide(all, triangles);
}

}  // namespace tolvol
