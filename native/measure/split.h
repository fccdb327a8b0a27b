// SPDX-License-Identifier: GPL-3.0-or-later
/// Cutting a triangle into parts over which the distance to another surface is easier to bound.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "geometry/frame.h"

namespace tolvol {

using TriangleCorners = std::array<glm::dvec3, 3>;

/// How far the corners of the parts are from where they would be in exact arithmetic, in a frame where |x| <= 1.
inline constexpr double kSplitError = 3 * kUnitRoundoff;

struct Parts {
  std::array<TriangleCorners, 3> corners;
  int count = 0;
};

/// Two or three parts of `piece`, which together are all of it, turned as it is; none when it is as small as rounding.
/// Of a segment, two corners of which are equal, the two parts are segments that have one point in common.
/// A piece that is long beside `t`, the triangle of the other surface nearest to it, is cut in two at the middle of its
/// longest edge; otherwise along the edge of `t` that divides it best, by the plane through it perpendicular to `t`:
/// the distance of what lies above `t` is largest at a corner. O(1).
Parts split(const TriangleCorners& piece, const TriangleCorners& t);

}  // namespace tolvol
