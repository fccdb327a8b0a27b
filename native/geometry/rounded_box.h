// SPDX-License-Identifier: GPL-3.0-or-later
/// Boxes in half the memory: float32, rounded outwards.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <limits>

namespace tolvol {

/// A box around points whose coordinates are in the range of float32. It is empty until a point is added.
struct RoundedBox {
  glm::vec3 lower{std::numeric_limits<float>::infinity()};
  glm::vec3 upper{-std::numeric_limits<float>::infinity()};

  void add(const glm::dvec3& p) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    for (int k = 0; k < 3; ++k) {
      const auto nearest = static_cast<float>(p[k]);
      lower[k] = std::fmin(lower[k], nearest > p[k] ? std::nextafter(nearest, -kInfinity) : nearest);
      upper[k] = std::fmax(upper[k], nearest < p[k] ? std::nextafter(nearest, kInfinity) : nearest);
    }
  }
  void add(const RoundedBox& box) {
    lower = glm::min(lower, box.lower);
    upper = glm::max(upper, box.upper);
  }
  bool empty() const { return lower.x > upper.x; }
};

}  // namespace tolvol
