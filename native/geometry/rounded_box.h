// SPDX-License-Identifier: GPL-3.0-or-later
/// Boxes in half the memory: float32, rounded outwards.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// A box relative to the origin of its BoxRounding.
struct RoundedBox {
  glm::vec3 lower{std::numeric_limits<float>::infinity()};
  glm::vec3 upper{-std::numeric_limits<float>::infinity()};

  void add(const RoundedBox& box) {
    lower = glm::min(lower, box.lower);
    upper = glm::max(upper, box.upper);
  }
  bool empty() const { return lower.x > upper.x; }
  friend bool operator==(const RoundedBox&, const RoundedBox&) = default;
};

/// Whether two boxes of one BoxRounding have a point in common; one that is empty has none.
inline bool meet(const RoundedBox& a, const RoundedBox& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y && b.lower.y <= a.upper.y &&
         a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}

/// Rounds boxes. The nearer they are to the origin the less they grow: by two float32 ulps of their distance at most.
class BoxRounding {
 public:
  explicit BoxRounding(const glm::dvec3& origin = glm::dvec3(0)) : origin_(origin) {
    const glm::dvec3 slack = 4 * std::numeric_limits<double>::epsilon() * glm::abs(origin);
    below_ = origin - slack, above_ = origin + slack;
  }

  /// Two boxes that meet do so after they were rounded: every step of it is monotone. An empty box stays empty.
  RoundedBox operator()(const Box& box) const {
    RoundedBox rounded;
    if (box.empty()) return rounded;
    for (int k = 0; k < 3; ++k) {
      const float lower = nearest(box.lower[k] - origin_[k]), upper = nearest(box.upper[k] - origin_[k]);
      rounded.lower[k] = lower - ulp(lower), rounded.upper[k] = upper + ulp(upper);
    }
    return rounded;
  }

  /// A box around all boxes that are rounded to this one.
  Box around(const RoundedBox& rounded) const {
    Box box;
    if (rounded.empty()) return box;
    for (int k = 0; k < 3; ++k) {
      constexpr double kInfinity = std::numeric_limits<double>::infinity();
      box.lower[k] = rounded.lower[k] <= -kFarthest ? -kInfinity : below_[k] + static_cast<double>(rounded.lower[k]);
      box.upper[k] = rounded.upper[k] >= kFarthest ? kInfinity : above_[k] + static_cast<double>(rounded.upper[k]);
    }
    return box;
  }

 private:
  /// All that is farther away counts as being so far. From here an ulp more is still finite, so that no box that is not
  /// empty meets one that is.
  static constexpr float kFarthest = 1e38f;

  static float nearest(double x) {
    return static_cast<float>(std::clamp(x, static_cast<double>(-kFarthest), static_cast<double>(kFarthest)));
  }
  /// At least the distance to the next float32 on either side.
  static float ulp(float x) {
    return std::abs(x) * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min();
  }

  glm::dvec3 origin_, below_, above_;
};

}  // namespace tolvol
