// SPDX-License-Identifier: GPL-3.0-or-later
/// The grid of a mesh before anything fills it.
#pragma once

#include <glm/glm.hpp>

#include "field/distance_grid.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

inline DistanceGrid laid_out(const TriangleMesh& mesh, double tolerance, double precision) {
  Box box;
  for (const glm::dvec3& p : mesh.vertices) box.add(p);
  return layout_grid(box, tolerance, precision);
}

}  // namespace tolvol
