// SPDX-License-Identifier: GPL-3.0-or-later
/// Carries a decimated mesh back to the vertices, triangles and attributes of the input.
#pragma once

#include "decimation/bounded_mesh.h"
#include "decimation/decimation.h"
#include "decimation/decimation_input.h"

namespace tolvol {

/// Writes the result's arrays and what was repaired. `mesh`: what became of input.take_mesh().
void write_result(const DecimationInput& input, const BoundedMesh& mesh, DecimationResult& result);

}  // namespace tolvol
