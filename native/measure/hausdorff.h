// SPDX-License-Identifier: GPL-3.0-or-later
/// How far one surface is from another, as an interval that is certain.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "base/progress.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

struct HausdorffOptions {
  /// What the answer is compared with. The search then goes on until upper <= bound or lower > bound, and in the first
  /// case until the interval is narrow too.
  std::optional<double> bound = {};
  unsigned threads = 0;          ///< 0: one per core; the result does not depend on it
  Progress* progress = nullptr;  ///< throws Cancelled from the call once it is cancelled
};

struct HausdorffInterval {
  double lower, upper;     ///< in the units of the meshes
  glm::dvec3 position;     ///< the point of a that shows `lower`, up to rounding
  std::uint32_t triangle;  ///< the triangle of a it lies on
};

/// lower <= sup over x in a of the distance from x to b <= upper, in exact arithmetic on the coordinates as given: all
/// rounding is inside the interval. Every point of every triangle of a counts (degenerate ones are the segments or
/// points they are), vertices that no triangle uses do not.
///
/// Narrow means upper - lower <= 0.1 % of upper, or a distance that is rounding itself: identical or subdivided
/// surfaces end with an upper of about 1e-15 of the size of both meshes together. Triangles of b that reach farther
/// away than what is nearest to a can lie do not add to that size: at most a few hundred times the size of a and its
/// distance from b counts, wherever their far corners are. The exceptions are triangles that pass a while all their
/// corners are far away, or that open to more than about 170 degrees at the one near corner: they count as a whole.
/// Where narrow would need many millions of pieces the search stops with the interval it has, and so it does as soon as
/// lower > bound: wider, but true.
///
/// Throws InvalidInput when a mesh is not valid (measure/placed_pair.h) or the bound is negative or not a number,
/// Cancelled. Shares no code with the check of operations (check/), which it judges. Cost: below 1 us for each triangle
/// of a and of b, then as much for each piece; 0.1 s between a scan of 270,000 triangles and its decimation to 200,
/// either way.
HausdorffInterval hausdorff(const TriangleMesh& a, const TriangleMesh& b, const HausdorffOptions& options = {});

}  // namespace tolvol
