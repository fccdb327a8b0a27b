// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether triangles cover a segment one after the other: a search for a proof that finds one wherever there is one.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "check/witness.h"
#include "geometry/hierarchy.h"

namespace tolvol {

/// The share of witness_error() by which a cover along a segment may exceed the provable distance: the error of a
/// distance is 47 u (R + d) as derived there, and a point of the segment is placed once, not cut 32 times, 5.2 u more.
/// Of the 256 u this leaves 203.
///
/// It is needed to find again what another search has proved. Parts of a larger piece lie up to 32 * 3 u (1 + d) from
/// the piece, where |x| <= 1 + d as in a frame, and have witnesses whose distance errs by 47 u: 143 u together. The
/// rest of the 192 u is for the error of the distances looked at here.
inline constexpr double kCoverShare = 0.75;

/// Whether every point of the segment from a to b is within the tolerance of one of the triangles, `limit` being the
/// provable distance (ToleranceVolume::provable). True wherever parts of any larger piece of the frame prove it, as
/// long as these were at most 2^20. `hierarchy`: of the triangles. The distance to a triangle is convex along the
/// segment, so each covers one interval; of those that cover a point, the one that reaches farthest is followed to its
/// end, and so on. No more intervals than those of any other cover; each costs about 0.1 us for each triangle near its
/// beginning.
bool covers_segment(const std::vector<WitnessTriangle>& triangles, const Hierarchy& hierarchy, const glm::dvec3& a,
                    const glm::dvec3& b, double limit);

}  // namespace tolvol
