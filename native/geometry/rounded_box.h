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

/// Rounds boxes. On each side a box grows by at most 2.5 times the distance of two float32 at its distance from the
/// origin, by 2^-126 of `size`, and by 2^-50 of the origin's own distance from 0.
class BoxRounding {
 public:
  /// Most coordinates should lie around the origin, at distances about or below `size`, which is not negative. Without
  /// arguments a rounded box has the coordinates as they are, but for the rounding.
  explicit BoxRounding(const glm::dvec3& origin = glm::dvec3(0), double size = 1) : origin_(origin) {
    const int exponent = std::ilogb(std::clamp(size, 0x1p-900, 0x1p900));
    scale_ = std::ldexp(1.0, -exponent), unscale_ = std::ldexp(1.0, exponent);
    const glm::dvec3 slack = 4 * std::numeric_limits<double>::epsilon() * glm::abs(origin);
    below_ = origin - slack, above_ = origin + slack;
  }

  /// Two boxes that meet do so after they were rounded: rounding keeps the order of numbers, and both only grow. An
  /// empty box stays empty.
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
      constexpr double kInfinity = std::numeric_limits<double>::infinity(), kMost = std::numeric_limits<double>::max();
      const double lower = rounded.lower[k], upper = rounded.upper[k];
      box.lower[k] = lower <= -kFarthest ? -kInfinity : std::min(below_[k] + lower * unscale_, kMost);
      box.upper[k] = upper >= kFarthest ? kInfinity : std::max(above_[k] + upper * unscale_, -kMost);
    }
    return box;
  }

 private:
  /// All that is farther away counts as being so far. From here an ulp more is still finite, so that no box that is not
  /// empty meets one that is.
  static constexpr float kFarthest = 1e38f;

  float nearest(double from_origin) const {
    constexpr double kMost = kFarthest;
    return static_cast<float>(std::clamp(from_origin * scale_, -kMost, kMost));
  }
  /// At least the distance to the next float32 on either side.
  static float ulp(float x) {
    return std::abs(x) * std::numeric_limits<float>::epsilon() + std::numeric_limits<float>::min();
  }

  glm::dvec3 origin_, below_, above_;
  double scale_, unscale_;  // Powers of two, so that products with them are exact.
};

}  // namespace tolvol
