// SPDX-License-Identifier: GPL-3.0-or-later
/// The distance of one surface from another on the whole: mean, percentiles and shares of the area, each as an estimate
/// and as a range that holds the true number. hausdorff.h is about the largest distance.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "geometry/triangle_mesh.h"
#include "measure/distance_bounds.h"

namespace tolvol {

struct DeviationOptions {
  std::span<const double> bounds = {};       ///< are lengths of 0 or more for share_beyond
  std::span<const double> percentiles = {};  ///< are from 0 to 100
  unsigned threads = 0;                      ///< 0 means one for each core; the result does not depend on it
  Progress* progress = nullptr;              ///< the call throws Cancelled once this is cancelled
  double steps = 128;                        ///< is the mean number of search steps of a piece at which cutting ends
  /// About how many pieces a is first cut into. Those of a scan are then about 0.25 % of its size apart. Fewer pieces
  /// that are cut further would not be cheaper: each part and each whole would be bounded.
  std::size_t pieces = 196608;
};

/// A number, and the range that holds the true number whatever lies between the samples.
struct Estimate {
  double value = 0;
  Range range;
};

/// The two sides of a closed surface. Distances outside are positive.
struct Sides {
  Estimate mean;          ///< is signed, the shift of the one surface against the other
  Estimate share_inside;  ///< is a share of the area
  Range inside, outside;  ///< are the largest distances on each side, 0 or more
};

struct Deviation {
  Estimate mean, rms;                  ///< are of the distance from a to b, by area, in the units of the meshes
  double mean_error;                   ///< bounds the standard error of mean.value
  std::vector<Estimate> share_beyond;  ///< is for each bound the share of the area of a that is farther, 0 to 1
  std::vector<Estimate> percentiles;   ///< is for each p the least distance that p % of the area of a does not exceed
  std::optional<Sides> sides;          ///< exists if b is closed
  std::vector<double> distances;       ///< are those of the samples, signed if b is closed
  std::vector<double> weights;         ///< are the shares of the area that the samples stand for, with the sum 1
  double spacing;                      ///< is the side of the square for which a sample stands on average
  std::size_t steps;                   ///< counts the nodes of the hierarchy and triangles that were looked at
};

/// Covers a with about `pieces` pieces of equal area, at least one for each triangle, and cuts the worst pieces. It
/// stops when the range of the mean is no wider than 0.1 % of the largest distance that was seen or than rounding,
/// 3e-14 of the size of both meshes together; when there are a sixth more pieces than that, or four for each triangle
/// if that is more; or when the searches for near triangles have taken `steps` for each of so many pieces, as they do
/// among needles or if the surfaces cross everywhere. The exact distance of one point of each piece enters the
/// estimates, and bounds over the whole piece (measure/distance_bounds.h) enter the ranges. The points are fixed, so
/// that equal input gives equal output, but as good as random: no estimate is biased, and the error of the mean is
/// usually below twice `mean_error`, which is about 0.05 % of the largest distance between a scan and a copy within 0.1
/// % of its size, and less if they are farther apart. The ranges are certain except for rounding, 1e-12 of the size of
/// the meshes (more only if nearly all the area is in needles), and no estimate is outside of its range. Ranges are
/// wide between surfaces nearer to each other than `spacing`. Far corners of triangles of b do not count for the size,
/// with the exceptions that measure/hausdorff.h names. If a has no area, it is measured along the longest edges of its
/// triangles instead, and if these have no length either, all triangles count alike and `spacing` is 0.
///
/// b is closed if each of its edges has two faces that run along it in opposite directions. Its angle-weighted
/// pseudonormals (geometry/pseudonormals.h) tell the inside, turned round if its volume is negative. This is certain
/// unless b intersects itself.
///
/// Throws InvalidInput if a mesh is not valid (geometry/triangle_mesh.h), a bound is not a length of 0 or more or a
/// percentile is not between 0 and 100, and Cancelled. A piece costs 2 to 15 us and 300 bytes. Each of the first pieces
/// takes one search of the hierarchy of b even if all steps are used up; their ranges are then as wide as they are
/// long.
Deviation deviation(const TriangleMesh& a, const TriangleMesh& b, const DeviationOptions& options = {});

}  // namespace tolvol
