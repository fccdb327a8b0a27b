// SPDX-License-Identifier: GPL-3.0-or-later
/// Signed distances by fast marching, as in the paper [Botsch04, §2]. They are here to be compared with scatter().
#pragma once

#include "base/progress.h"
#include "field/distance_grid.h"

namespace tolvol {

/// Fills a grid laid out by layout_grid(). Nodes within one cell of the reference get their exact distance, closest
/// triangle and the sign that Pseudonormals give. From these the front marches with speed 1 by first-order upwind
/// differences, which are off by O(h), mostly too far. It ends as soon as a node farther than `stop` is conquered (the
/// tolerance in the paper, at most the band). Marched nodes have kNone for a triangle. Nodes that were not reached hold
/// the band, never infinity, so that interpolation stays finite. Signs are carried along. They are right everywhere on
/// closed meshes. On others Pseudonormals estimate them, which extrudes the boundary. On spheres with a round hole at
/// most 0.3 % of the marched nodes then have another sign than for the whole sphere, at tolerances up to 1.8 times the
/// radius of the hole, but values jump across the extrusion.
///
/// The result depends neither on the number of threads nor on the instructions. O(nodes near the surface + n log n for
/// n conquered nodes).
void fast_marching(const TriangleMesh& reference, DistanceGrid& grid, double stop, unsigned threads = 0,
                   Progress* progress = nullptr);

}  // namespace tolvol
