// SPDX-License-Identifier: GPL-3.0-or-later
/// Meshes with holes.
#pragma once

#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// The mesh without the triangles for which drop(index) holds.
template <class Drop>
TriangleMesh without(TriangleMesh mesh, Drop&& drop) {
  std::vector<glm::uvec3> kept;
  for (unsigned t = 0; t < mesh.triangles.size(); ++t) {
    if (!drop(t)) kept.push_back(mesh.triangles[t]);
  }
  mesh.triangles = std::move(kept);
  return mesh;
}

}  // namespace tolvol
