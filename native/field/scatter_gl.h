// SPDX-License-Identifier: GPL-3.0-or-later
/// The same field as scatter()'s, computed by a compute shader. [Botsch04] names distance fields on the GPU as future
/// work.
#pragma once

#include "base/progress.h"
#include "field/distance_grid.h"

namespace tolvol {

/// Fills a grid laid out by layout_grid() as scatter() does. Distances differ from those of scatter() by what float32
/// rounds, and ids only where distances are equal up to that. Every id is that of a triangle, or kNone, whatever the
/// GPU computes. Must not be called on the GL thread. Throws GlUnavailable, and ResourceLimit for a grid that is larger
/// than a buffer of this GL. O(nodes in the boxes of the triangles, of which large ones are divided).
void scatter_gl(const TriangleMesh& reference, DistanceGrid& grid, Progress* progress = nullptr);

}  // namespace tolvol
