// SPDX-License-Identifier: GPL-3.0-or-later
/// Two meshes in one frame, in which both together have a size of about 1. Every measurement starts with such a pair.
#pragma once

#include <cmath>

#include "base/call.h"
#include "base/errors.h"
#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"
#include "measure/near_part.h"

namespace tolvol {

struct PlacedPair {
  Frame frame;
  TriangleMesh a, b;  ///< b is the part that can be nearest to a point of a (measure/near_part.h)
  bool whole;         ///< tells whether that is all of b

  /// The frame fits the vertices that triangles use. Other vertices may lie anywhere. Throws InvalidInput if a mesh is
  /// not valid, or if both together are smaller than 1e-307.
  PlacedPair(const TriangleMesh& world_a, const TriangleMesh& world_b) {
    for (const TriangleMesh* mesh : {&world_a, &world_b}) validate(mesh->vertices, mesh->triangles);
    const NearPart part = near_part(world_a, world_b);
    whole = part.whole;
    Box box;
    std::size_t turn = 0;
    const auto add = [&](const TriangleMesh& mesh, const std::vector<glm::uvec3>& triangles) {
      for (const glm::uvec3& t : triangles) {
        poll_at(++turn);
        for (int k = 0; k < 3; ++k) {
          if (t[k] < mesh.vertices.size()) box.add(mesh.vertices[t[k]]);
        }
      }
    };
    add(world_a, world_a.triangles);
    add(world_b, part.triangles);
    for (const NearPart::Cut& cut : part.cuts) box.add(cut.in(Frame(), world_b));
    frame = Frame(box);
    if (!std::isfinite(frame.scale()))
      throw InvalidInput("the meshes are smaller than 1e-307: scale them up", "invalid_mesh");
    a = placed(world_a);
    b = placed(world_b);
    b.triangles = part.triangles;
    for (const NearPart::Cut& cut : part.cuts) b.vertices.push_back(cut.in(frame, world_b));
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
