// SPDX-License-Identifier: GPL-3.0-or-later
/// Cuts needles that share a corner, the hub, into slices, for a Hierarchy.
///
/// Needles around a hub do not fill boxes that are turned along them: each is as wide at the hub as at the other end,
/// so that near the hub a search would look at all of them. Each slice is kTaper times as far from the hub as the one
/// before. A line of a cut is as far from the hub on both edges there: a line parallel to the opposite edge would be as
/// long as the needle if only one of its edges at the hub is short. A slice stands for the whole triangle, so that the
/// nearest triangle does not depend on the slices.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "base/default_init.h"
#include "geometry/hierarchy.h"

namespace tolvol {

class Team;
struct MortonKey;

/// The lengths of the two edges at the hub of a triangle: to the next corner, and to the one after it.
struct Legs {
  double b, c;
  Legs(const Corners& t, std::uint32_t hub)
      : b(glm::distance(t[(hub + 1) % 3], t[hub])), c(glm::distance(t[(hub + 2) % 3], t[hub])) {}
  double longer() const { return std::max(b, c); }
};

/// The corners of a convex part of a triangle that holds a slice, in local coordinates (hierarchy.cpp). Where there are
/// fewer than five, some are the same.
using Outline = std::array<glm::dvec3, 5>;

/// Boxes of slices are wider by this, in local coordinates, because the computed corners of an outline err by less than
/// 7e-14: a share of an edge errs by less than 9 u / kSharp (hub_slices.cpp), u = 2^-53, and an edge is at most 3.5
/// long.
inline constexpr double kSliceRoom = 1e-13;

/// Returns the outline of a slice of a triangle, whose corners and whose hierarchy's centre are scaled.
Outline outline(const Corners& corners, const HubSlice& slice, const glm::dvec3& centre);

struct HubSlices {
  std::vector<HubSlice> slices;
  std::vector<Outline> outlines;
};

/// Returns the slices of the triangles around hubs. `keys` are those of triangles of the mesh, sorted by code. The key
/// of each triangle that is cut is replaced by one for each of its slices, and the keys are sorted again. `scale` and
/// `centre` are the hierarchy's. O(n).
HubSlices cut_at_hubs(const TriangleMesh& mesh, double scale, const glm::dvec3& centre, Unfilled<MortonKey>& keys,
                      Team& team);

}  // namespace tolvol
