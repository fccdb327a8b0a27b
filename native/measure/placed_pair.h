// SPDX-License-Identifier: GPL-3.0-or-later
/// Two meshes in one frame, where both are about 1 large: what every measurement starts with.
#pragma once

#include <cmath>

#include "reference/call.h"
#include "reference/errors.h"
#include "reference/frame.h"
#include "reference/triangle_mesh.h"

namespace tolvol {

struct PlacedPair {
  Frame frame;
  TriangleMesh a, b;

  /// The frame fits the vertices that triangles use; the others may lie anywhere. Throws InvalidInput when a mesh is
  /// not valid, or when both together are smaller than 1e-307.
  PlacedPair(const TriangleMesh& world_a, const TriangleMesh& world_b) {
    Box box;
    for (const TriangleMesh* mesh : {&world_a, &world_b}) {
      validate(mesh->vertices, mesh->triangles);
      std::size_t turn = 0;
      for (const glm::uvec3& t : mesh->triangles) {
        poll_at(++turn);
        for (int k = 0; k < 3; ++k) box.add(mesh->vertices[t[k]]);
      }
    }
    frame = Frame(box);
    if (!std::isfinite(frame.scale())) throw InvalidInput("the meshes are smaller than 1e-307: scale them up");
    a = placed(world_a);
    b = placed(world_b);
  }

 private:
  TriangleMesh placed(const TriangleMesh& mesh) const {
    TriangleMesh copy = mesh;
    poll();
    for (glm::dvec3& p : copy.vertices) p = frame.from_world(p);
    return copy;
  }
};

}  // namespace tolvol
