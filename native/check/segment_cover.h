// SPDX-License-Identifier: GPL-3.0-or-later
/// A search that tells whether triangles cover a segment one after the other. It finds a proof wherever there is one.
#pragma once

#include <glm/glm.hpp>

#include "check/witness.h"
#include "geometry/hierarchy.h"

namespace tolvol {

/// A cover along a segment may exceed the provable distance by this share of witness_error(). The error of a distance
/// is below 64 u (R + d): closest_point() errs by 36 u (geometry/closest_point.cpp), and the corners that it gets by 6
/// u. A point of the segment is placed once and not cut 64 times, which adds 5.2 u. This leaves 442 of the 512 u.
///
/// The share is needed to find again what another search has proved. Parts of a larger piece lie up to 64 * 3 u (1 + d)
/// from the piece, where |x| <= 1 + d as in a frame, and the distances of their witnesses err by 47 u, together 239 u.
/// The rest of the 384 u is for the error of the distances that are computed here.
inline constexpr double kCoverShare = 0.75;

/// Tells whether every point of the segment from a to b is within the tolerance of one of the triangles, which are in
/// `hierarchy`. `limit` is the provable distance (ToleranceVolume::provable). The result is true wherever parts of a
/// larger piece in the frame prove it, if they are at most 2^20. The distance to a triangle is convex along the
/// segment, so that each triangle covers one interval. The search follows, of the intervals that cover a point, the one
/// that reaches farthest to its end, and so on. No other cover has fewer intervals. Each interval costs about 0.1 us
/// for each triangle near its beginning.
bool covers_segment(const Witnesses& triangles, const Hierarchy& hierarchy, const glm::dvec3& a, const glm::dvec3& b,
                    double limit);

}  // namespace tolvol
