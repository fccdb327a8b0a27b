// SPDX-License-Identifier: GPL-3.0-or-later
/// How far one surface is from another on average: statistics by samples, where hausdorff.h is certain about the
/// largest.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "reference/progress.h"
#include "reference/triangle_mesh.h"

namespace tolvol {

struct DeviationOptions {
  unsigned threads = 0;          ///< 0: one per core; the result does not depend on it
  Progress* progress = nullptr;  ///< throws Cancelled from the call once it is cancelled
};

struct Deviation {
  double mean, rms;                  ///< of the distance from a to b, weighted by area, in the units of the meshes
  std::vector<double> share_beyond;  ///< for each bound the share of the area of a that is farther than it, 0 to 1
  double spacing;                    ///< side of the square that a sample stands for, in the units of the meshes
  std::size_t samples;
};

/// The exact distance to b at samples that cover a: the centroids of the k x k equal triangles into which each triangle
/// is cut, k so that each stands for about 1/262,144 of the area, and at least one for each triangle. Nothing random:
/// equal input gives equal output. Where a has no area at all it is measured along the longest edges of its triangles
/// instead, and where these have no length either all triangles count alike (spacing 0). Throws InvalidInput when a
/// mesh is not valid (reference/triangle_mesh.h) or a bound is not a length of 0 or more, Cancelled. Cost: about 1 us a
/// sample.
Deviation deviation(const TriangleMesh& a, const TriangleMesh& b, std::span<const double> bounds = {},
                    const DeviationOptions& options = {});

}  // namespace tolvol
