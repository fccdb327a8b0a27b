// SPDX-License-Identifier: GPL-3.0-or-later
/// The distance of one surface from another, as a certain interval.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "base/progress.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

struct HausdorffOptions {
  /// The caller compares the distance with this bound. The search goes on until upper <= bound or lower > bound, and in
  /// the first case until the interval is narrow too.
  std::optional<double> bound = {};
  unsigned threads = 0;          ///< 0 means one for each core; the result does not depend on it
  Progress* progress = nullptr;  ///< the call throws Cancelled once this is cancelled
  bool narrow = true;            ///< false: the search ends as soon as upper <= bound or lower > bound
};

struct HausdorffInterval {
  double lower, upper;     ///< are in the units of the meshes
  glm::dvec3 position;     ///< is the point of a that shows `lower`, up to rounding
  std::uint32_t triangle;  ///< is the triangle of a on which `position` lies
};

/// Returns lower <= sup over x in a of the distance from x to b <= upper, in exact arithmetic on the coordinates as
/// given: all rounding is inside the interval. Every point of every triangle of a counts. A degenerate triangle counts
/// as the segment or point that it is, and a vertex that no triangle uses does not count.
///
/// An interval is narrow if upper - lower <= 0.1 % of upper, or if the distance is within rounding: identical or
/// subdivided surfaces end with an upper of about 1e-15 of the size of both meshes together. The far corners of
/// triangles of b do not add to this size: at most a few hundred times the size of a and its distance from b counts.
/// The exceptions are triangles whose corners are all far away and whose plane passes near a, and triangles that open
/// to more than about 170 degrees at the one near corner; they count as a whole. So do far corners of a, whose own
/// distance is measured: the interval is then no narrower than about 1e-15 of the size of a. A long search,
/// as between needles that lie on one another, accepts a wider interval, which is still true: with every 20,000 pieces
/// and 12 for each triangle the width may grow by 0.1 % of the bound, or of a thousandth of the size if that is less.
/// The search stops after a million pieces and 16 for each triangle, or four million if lower <= bound < upper until
/// then, and as soon as lower > bound. At a corner that thousands of triangles share, a piece may count for several, so
/// that the search ends earlier.
///
/// Throws InvalidInput if a mesh is not valid (measure/placed_pair.h) or the bound is negative or not a number, and
/// Cancelled. The bounds share no code with the check of operations (check/), which they judge. They share with it the
/// hierarchy, the frame and the threads (geometry/, base/), and are tested against brute force and CGAL. The cost is
/// below 1 us for each triangle of a and of b and for each piece: 0.1 s between a scan of 270,000 triangles and its
/// decimation to 200, either way.
HausdorffInterval hausdorff(const TriangleMesh& a, const TriangleMesh& b, const HausdorffOptions& options = {});

}  // namespace tolvol
