// SPDX-License-Identifier: GPL-3.0-or-later
/// Measures of a vector's length that take no square root.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace tolvol {

inline double squared_length(const glm::dvec3& v) { return glm::dot(v, v); }

/// The largest absolute value of a coordinate.
inline double largest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

}  // namespace tolvol
