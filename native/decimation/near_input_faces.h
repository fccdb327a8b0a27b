// SPDX-License-Identifier: GPL-3.0-or-later
/// The faces near a face of the input, by the hierarchy of the reference, where the input is the reference itself. A
/// tree of the input alone takes more memory, and a fifth of a second for a million faces.
#pragma once

#include "decimation/decimation_input.h"
#include "topology/input_crossings.h"

namespace tolvol {

/// Returns nothing where the input is not the reference. It keeps a reference to the input, whose mesh was taken, and
/// may be asked by several threads at once. About 3 us a face.
InputCrossings::FindNear near_input_faces(const DecimationInput& input);

}  // namespace tolvol
