// SPDX-License-Identifier: GPL-3.0-or-later
/// Exact distances and closest triangles at the nodes of a grid, in the band that the reference's triangles reach.
#pragma once

#include "base/progress.h"
#include "field/distance_grid.h"

namespace tolvol {

/// Fills a grid laid out by layout_grid() with the unsigned distance and the closest triangle, both up to the rounding
/// of float32, at every node within the band. If rounded distances tie, the lower index stays, so that the result
/// depends neither on the number of threads nor on the instructions. The certificate needs only the ids; trilinear
/// interpolation needs the distances. O(nodes in the bands).
void scatter(const TriangleMesh& reference, DistanceGrid& grid, unsigned threads = 0, Progress* progress = nullptr);

}  // namespace tolvol
