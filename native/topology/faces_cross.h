// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether two triangles cross: an exact answer for the coordinates as they are stored.
#pragma once

#include "geometry/triangle_mesh.h"

namespace tolvol {

Box box_of(const Corners& corners);

/// Whether the corners lie on one line or in one point, decided exactly. O(1).
bool is_degenerate(const Corners& t);

/// Two triangles cross when they meet anywhere but in the corners and edges that they share. A corner is shared where
/// both have the same coordinates. Triangles in one plane that overlap cross, and so do two triangles on the same three
/// corners. A degenerate triangle counts as the segment or the point that it is: it crosses what that meets, but two
/// degenerate triangles never cross. Coordinates must be finite. Rounding changes no answer: where surely_uncrossed()
/// (topology/faces_apart.h) leaves a doubt, CGAL's predicates decide (Exact_predicates_inexact_constructions_kernel).
/// O(1), 10 ns to 1 us; more where predicates need exact arithmetic.
bool faces_cross(const Corners& a, const Corners& b);

/// The same by the predicates alone, which judge surely_uncrossed() in the tests. O(1), 20 ns to 1 us, or more.
bool faces_cross_exactly(const Corners& a, const Corners& b);

}  // namespace tolvol
