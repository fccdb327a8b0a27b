// SPDX-License-Identifier: GPL-3.0-or-later
/// A mesh as it is stored, its place in the world, and a tolerance in percent of its size.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "check/tolerance_volume.h"
#include "geometry/frame.h"

namespace tolvol {

struct PlacedMesh {
  TriangleMesh mesh;
  glm::dmat4 to_world = glm::dmat4(1);
  Storage storage = Storage::float32;
  double percent = 1;

  StoredSpace space() const { return {to_world, storage}; }
  double tolerance() const { return percent / 100 * longest_diagonal(mesh.vertices, mesh.triangles, to_world); }
  /// Of a share of the tolerance.
  std::unique_ptr<ToleranceVolume> volume(double share = 1) const {
    return std::make_unique<ToleranceVolume>(mesh.vertices, mesh.triangles, space(), share * tolerance());
  }
  TriangleMesh world(std::vector<glm::dvec3> vertices, std::vector<glm::uvec3> triangles) const {
    for (glm::dvec3& p : vertices) p = space().world(p);
    return {std::move(vertices), std::move(triangles)};
  }
};

}  // namespace tolvol
