// SPDX-License-Identifier: GPL-3.0-or-later
/// The largest distance of a point of one mesh from another, by CGAL. It shares no code with hausdorff() but the type
/// of meshes.
#pragma once

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// The distance of `a` from `b`, wrong by at most `error`. The triangles may be connected in any way.
double distance_by_cgal(const TriangleMesh& a, const TriangleMesh& b, double error);

}  // namespace tolvol
