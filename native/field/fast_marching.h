// SPDX-License-Identifier: GPL-3.0-or-later
/// Signed distances by fast marching: the field of the paper [Botsch04, §2], kept beside scatter() for comparison.
#pragma once

#include "base/progress.h"
#include "field/distance_grid.h"

namespace tolvol {

/// Fills a grid laid out by layout_grid(). Nodes within one cell of the reference get their exact distance, closest
/// triangle and the sign that Pseudonormals give; from these the front marches with speed 1 by first-order upwind
/// differences, which are off by O(h), mostly too far, and ends as soon as a node farther than `stop` (the tolerance in
/// the paper, at most the band) is conquered. What was marched has kNone for a triangle; what was not reached holds the
/// band, never infinity, so that interpolation stays finite. Signs are carried along: right
/// everywhere on closed meshes; on others estimated as Pseudonormals do, which extrudes the boundary. On spheres with a
/// round hole that leaves at most 0.3 % of the marched nodes with another sign than the whole sphere's, at tolerances
/// up to 1.8 times the radius of the hole; but values jump across the extrusion.
///
/// The result depends neither on the number of threads nor on the instructions used. O(nodes near the surface + n log n
/// of those conquered).
void fast_marching(const TriangleMesh& reference, DistanceGrid& grid, double stop, unsigned threads = 0,
                   Progress* progress = nullptr);

}  // namespace tolvol
