// SPDX-License-Identifier: GPL-3.0-or-later
/// Cuts a triangle into parts over which the distance to another surface is easier to bound.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "geometry/frame.h"

namespace tolvol {

using TriangleCorners = std::array<glm::dvec3, 3>;

/// The corners of the parts are at most this far from their exact places, in a frame where |x| <= 1.
inline constexpr double kSplitError = 3 * kUnitRoundoff;

struct Parts {
  std::array<TriangleCorners, 3> corners;
  int count = 0;
};

/// Returns two or three parts of `piece`, which together are all of it and are turned as it is, or no part if the piece
/// is as small as rounding. A segment, two corners of which are equal, has two segments with one common point as parts.
/// `t` is the triangle of the other surface nearest to the piece. A piece that is much longer than `t` is cut in two at
/// the middle of its longest edge. Any other piece is cut along the edge of `t` that divides it best, by the plane that
/// is perpendicular to `t`: over a part above `t` the distance from `t` is largest at a corner. If `t` is flat within
/// rounding, it has two ends instead, and the planes there are perpendicular to it. If no plane divides the piece, it
/// is cut where `other` begins to be nearer than `t`, or else in two. `other` is the triangle nearest to the corner
/// that is farthest from `t`; it may be `t`. O(1).
Parts split(const TriangleCorners& piece, const TriangleCorners& t, const TriangleCorners& other);

}  // namespace tolvol
