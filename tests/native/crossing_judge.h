// SPDX-License-Identifier: GPL-3.0-or-later
/// Finds faces that cross by CGAL's self_intersections, and judges pairs by exact intersections. It shares CGAL's
/// predicates with topology/faces_cross.cpp, and no code of this project but its types.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "geometry/triangle_mesh.h"
#include "topology/faces_cross.h"

namespace tolvol {

using CrossingPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// The pairs of faces that cross, in order. Throws std::invalid_argument if the mesh is not an oriented manifold.
CrossingPairs crossings_by_cgal(const TriangleMesh& mesh);

/// Whether two triangles with an area cross, by their intersection, which is constructed exactly: it has to be a corner
/// or an edge of both.
bool cross_by_cgal(const Corners& a, const Corners& b);

}  // namespace tolvol
