// SPDX-License-Identifier: GPL-3.0-or-later
/// Decimation of a mesh by edge collapses. In rounds, the threads work on regions side by side, each up to the same
/// cost; then one loop works on the whole mesh.
///
/// The first rounds collapse regions on trust and prove them afterwards, because hardly a collapse would be refused. A
/// region fits the cache. How the mesh is cut into regions depends on the mesh alone, so that the result is the same
/// for any number of threads.
#pragma once

#include <cstddef>

#include "base/parallel.h"
#include "base/progress.h"
#include "decimation/bounded_mesh.h"
#include "topology/new_crossings.h"

namespace tolvol {

/// Collapses edges until none can collapse or `target` triangles are left. With a target other than 0 there are no
/// rounds, because a target asks for the order of the whole mesh; nor are there rounds without certified bounds. O(n
/// log n) without bounds. Throws Cancelled, and then leaves a mesh that is proved, with which the caller may go on.
/// `crossings` is null where crossings are allowed.
///
/// With `begins_anew` the order of the edges is that of the faces as they are after the rounds, and once more when no
/// edge can collapse any more. Both times it asks again about all edges that were refused.
void collapse_edges(BoundedMesh& mesh, NewCrossings* crossings, std::size_t target, bool begins_anew, Team& team,
                    Progress* progress);

/// Collapses the edges that can still collapse, in one loop over the whole mesh, after other changes than collapses. It
/// begins no stage of progress: for the user it belongs to the changes before it.
void collapse_once_more(BoundedMesh& mesh, NewCrossings* crossings, std::size_t target, Team& team);

}  // namespace tolvol
