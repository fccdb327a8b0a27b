// SPDX-License-Identifier: GPL-3.0-or-later
/// Makes candidates that mislead a check, and counts the wrong ones among those that it accepted, by
/// measure/hausdorff.h. The bounds of measure/hausdorff.h are its own. It shares native/geometry and native/base with
/// the checks, and is tested against brute force and CGAL.
#pragma once

#include <random>

#include "check/tolerance_check.h"
#include "measure/hausdorff.h"
#include "shapes.h"

namespace tolvol::candidates {

using glm::dvec3;

inline const StoredSpace kIdentity(glm::dmat4(1), Storage::float64);

/// Triangles in the world, three points each.
using Points = std::vector<dvec3>;

inline std::vector<std::uint32_t> corners(std::size_t count) {
  std::vector<std::uint32_t> indices(count);
  for (std::size_t i = 0; i < count; ++i) indices[i] = std::uint32_t(i);
  return indices;
}

inline std::vector<Verdict> ask(const ToleranceCheck& check, const Points& points, int of = 3) {
  return check.check({points, kIdentity, corners(points.size()), of}, {1, nullptr});
}

class Maker {
 public:
  Maker(const TriangleMesh& reference, double tolerance, unsigned seed)
      : reference_(&reference), tolerance_(tolerance), engine_(seed) {}

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  dvec3 direction() {
    std::normal_distribution<double> normal;
    return glm::normalize(dvec3(normal(engine_), normal(engine_), normal(engine_)));
  }
  const glm::uvec3& some_triangle() { return reference_->triangles[engine_() % reference_->triangles.size()]; }
  dvec3 on_surface() {
    const glm::uvec3 t = some_triangle();
    const double v = uniform(0, 1), w = uniform(0, 1 - v);
    return reference_->vertices[t.x] * (1 - v - w) + reference_->vertices[t.y] * v + reference_->vertices[t.z] * w;
  }

  /// A triangle of the reference with one corner moved by 0.5 to 1.7 tolerances.
  void spike(Points& points) {
    const glm::uvec3 t = some_triangle();
    for (int k = 0; k < 3; ++k) points.push_back(reference_->vertices[t[k]]);
    points[points.size() - 1 - engine_() % 3] += uniform(0.5, 1.7) * tolerance_ * direction();
  }
  /// Any size, any place within two tolerances.
  void anyhow(Points& points) {
    const dvec3 base = on_surface() + uniform(0, 2) * tolerance_ * direction();
    const double size = tolerance_ * std::pow(10.0, uniform(-3, 1));
    for (int k = 0; k < 3; ++k) points.push_back(base + size * uniform(0, 1) * direction());
  }
  /// Small or a needle, about the tolerance away.
  void near_tolerance(Points& points) {
    const dvec3 base = on_surface() + uniform(0.5, 1.02) * tolerance_ * direction();
    const dvec3 along = tolerance_ * std::pow(10.0, uniform(-3, 0)) * direction();
    points.push_back(base);
    points.push_back(base + along);
    points.push_back(base + uniform(0, 1) * along + 1e-7 * tolerance_ * direction());
  }
  /// From one place of the reference to another, over whatever is between.
  void bridge(Points& points) {
    for (int k = 0; k < 3; ++k) points.push_back(on_surface());
  }
  Points all_kinds(int count) {
    Points points;
    for (int i = 0; i < count; ++i) {
      switch (i % 4) {
        case 0:
          spike(points);
          break;
        case 1:
          anyhow(points);
          break;
        case 2:
          near_tolerance(points);
          break;
        default:
          i % 32 == 3 ? bridge(points) : near_tolerance(points);
      }
    }
    return points;
  }

 private:
  const TriangleMesh* reference_;
  double tolerance_;
  std::mt19937 engine_;
};

/// How many of the triangles are certain to be farther than the tolerance from the reference. One measurement when none
/// is, halves when some are.
inline int farther(const Points& points, const TriangleMesh& reference, double tolerance) {
  if (points.empty()) return 0;
  TriangleMesh mesh{points, {}};
  for (unsigned i = 0; i < points.size(); i += 3) mesh.triangles.emplace_back(i, i + 1, i + 2);
  const HausdorffInterval distance = hausdorff(mesh, reference, {.bound = tolerance, .threads = 1, .narrow = false});
  if (distance.upper <= tolerance) return 0;
  if (points.size() == 3) return distance.lower > tolerance;
  const auto middle = points.begin() + std::ptrdiff_t(points.size() / 6 * 3);
  return farther({points.begin(), middle}, reference, tolerance) +
         farther({middle, points.end()}, reference, tolerance);
}

inline Points accepted(const Points& points, const std::vector<Verdict>& verdicts) {
  Points result;
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    if (verdicts[i] == Verdict::inside)
      result.insert(result.end(), {points[3 * i], points[3 * i + 1], points[3 * i + 2]});
  }
  return result;
}

}  // namespace tolvol::candidates
