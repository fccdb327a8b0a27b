// SPDX-License-Identifier: GPL-3.0-or-later
/// Decimation of a mesh by edge collapses: rounds in which regions are worked on side by side, each as cheap edges as
/// in the others, then one loop over all that is left.
///
/// In the first rounds regions are collapsed on trust and proved afterwards, because hardly a collapse would be
/// refused. A region fits the cache, and the threads share them out. How the mesh is cut into regions depends on the
/// mesh alone: the result is the same for any number of threads.
#pragma once

#include <cstddef>

#include "base/parallel.h"
#include "base/progress.h"
#include "decimation/bounded_mesh.h"

namespace tolvol {

/// Until no edge can collapse or `target` triangles are left; with a target there are no rounds, because its order is
/// that of the whole. O(n log n) without bounds. Throws Cancelled, and then leaves the mesh with what is proved, so
/// that a caller who knows why may go on with it.
void collapse_edges(BoundedMesh& mesh, std::size_t target, Team& team, Progress* progress);

}  // namespace tolvol
