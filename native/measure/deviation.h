// SPDX-License-Identifier: GPL-3.0-or-later
/// How far one surface is from another on the whole: mean, percentiles and shares of the area, each as an estimate and
/// as a range that holds it, where hausdorff.h is about the largest distance.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "geometry/triangle_mesh.h"
#include "measure/distance_bounds.h"

namespace tolvol {

struct DeviationOptions {
  std::span<const double> bounds = {};       ///< lengths of 0 or more whose shares are wanted
  std::span<const double> percentiles = {};  ///< 0 to 100
  unsigned threads = 0;                      ///< 0: one per core; the result does not depend on it
  Progress* progress = nullptr;              ///< throws Cancelled from the call once it is cancelled
  double steps = 256;                        ///< of search that a piece may take on average before the cutting ends
};

/// A number, and the range that the true one is in whatever lies between the samples.
struct Estimate {
  double value = 0;
  Range range;
};

/// On which side of a closed surface; outside is above 0.
struct Sides {
  Estimate mean;          ///< with its sign: the shift of the one surface against the other
  Estimate share_inside;  ///< of the area
  Range inside, outside;  ///< the largest distance on each side, 0 or more
};

struct Deviation {
  Estimate mean, rms;                  ///< of the distance from a to b, weighted by area, in the units of the meshes
  double mean_error;                   ///< the standard error of mean.value is at most this
  std::vector<Estimate> share_beyond;  ///< for each bound the share of the area of a that is farther than it, 0 to 1
  std::vector<Estimate> percentiles;   ///< for each p the least distance that p % of the area of a does not exceed
  std::optional<Sides> sides;          ///< where b is closed
  std::vector<double> distances;       ///< of the samples; where b is closed with their sign
  std::vector<double> weights;         ///< the share of the area that each sample stands for, together 1
  double spacing;                      ///< side of the square that a sample stands for, in the middle
  std::size_t steps;  ///< nodes of the hierarchy and triangles that were looked at: the same on every machine
};

/// Covers a with pieces of about 1/65,536 of its area, at least one for each triangle, and cuts the worst until the
/// range of the mean is no wider than 0.1 % of the largest distance that was seen or than rounding, 3e-14 of the size
/// of both meshes together, or the pieces are half a million (four for each triangle where that is more), or their
/// searches for near triangles have taken `steps` for each of so many pieces: that is where needles crowd, or
/// surfaces cross everywhere. A piece gives the exact distance of one of its points to the estimates, and bounds on the
/// distance over all of it (measure/distance_bounds.h) to the ranges. The points are fixed, equal input gives equal
/// output, but as good as random: no estimate is off to one side, and the error of the mean is as a rule below twice
/// `mean_error`, which is about 0.05 % of the largest distance between a scan and a copy within 0.1 % of its size, and
/// less the farther they are apart. The ranges are certain but for rounding, 1e-12 of the size of the meshes (more only
/// where nearly all the area is in needles), and no estimate is outside of its range; between surfaces nearer to each
/// other than `spacing` they are wide. Where a has no area at all it is measured along the longest edges of its
/// triangles instead, and where these have no length either all triangles count alike (spacing 0).
///
/// b is closed when each of its edges has two faces that run along it in opposite directions. What is inside is told by
/// its angle-weighted pseudonormals (geometry/pseudonormals.h), turned round where its volume is negative: certain
/// unless b intersects itself.
///
/// Throws InvalidInput when a mesh is not valid (geometry/triangle_mesh.h), a bound is not a length of 0 or more or a
/// percentile is not one, Cancelled. Cost: 2 to 10 us and 200 bytes a piece, and one search of the hierarchy of b for
/// each of the first pieces even where all steps are made: their ranges are then as wide as they are long.
Deviation deviation(const TriangleMesh& a, const TriangleMesh& b, const DeviationOptions& options = {});

}  // namespace tolvol
