// SPDX-License-Identifier: GPL-3.0-or-later
/// Quick proofs that two triangles do not cross (topology/faces_cross.h), for those who ask about many pairs.
#pragma once

#include "topology/faces_cross.h"

namespace tolvol {

/// A lower bound on the distance of two triangles, 0 where none is found. Rounding is inside the bound. It is the
/// largest gap along a few directions, so that it is seldom far below the distance, or the first that is `enough`.
/// O(1), 10 to 50 ns.
double gap(const Corners& a, const Corners& b, double enough);

/// Whether it is certain, in spite of rounding, that the triangles do not cross. False where that is not certain. O(1),
/// 5 to 50 ns.
bool surely_uncrossed(const Corners& a, const Corners& b);

}  // namespace tolvol
