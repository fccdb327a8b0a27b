// SPDX-License-Identifier: GPL-3.0-or-later
/// Lengths and directions of vectors of any size.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>

namespace tolvol {

inline double squared_length(const glm::dvec3& v) { return glm::dot(v, v); }

/// The largest absolute value of a coordinate.
inline double largest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// The length, without the square of a number that is too large or too small for it. Infinite for one that is.
inline double norm(const glm::dvec3& v) {
  const double most = largest(v);
  return most > 0 && most < std::numeric_limits<double>::infinity() ? most * glm::length(v / most) : most;
}

/// The vector with length 1, up to rounding; not finite where the vector is 0 or not finite.
inline glm::dvec3 unit(const glm::dvec3& v) { return glm::normalize(v / largest(v)); }

}  // namespace tolvol
