// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/triangle_mesh.h"

#include <cmath>
#include <limits>
#include <sstream>

#include "base/call.h"
#include "base/errors.h"

namespace tolvol {

void require_finite(std::span<const glm::dvec3> vertices) {
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    poll_at(i);
    const glm::dvec3& p = vertices[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      std::ostringstream text;
      text << "vertex " << i << " is not finite (" << p.x << ", " << p.y << ", " << p.z << ")";
      throw InvalidInput(text.str(), "invalid_mesh");
    }
  }
}

void validate(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles) {
  if (vertices.empty()) throw InvalidInput("the mesh has no vertices", "invalid_mesh");
  if (triangles.empty()) throw InvalidInput("the mesh has no faces", "invalid_mesh");
  require_finite(vertices);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    poll_at(i);
    for (int k = 0; k < 3; ++k) {
      if (triangles[i][k] >= vertices.size()) {
        std::ostringstream text;
        text << "triangle " << i << " uses vertex " << triangles[i][k] << ", but there are only " << vertices.size();
        throw InvalidInput(text.str(), "invalid_mesh");
      }
    }
  }
}

std::vector<bool> used_vertices(std::size_t vertex_count, std::span<const glm::uvec3> triangles) {
  std::vector<bool> used(vertex_count, false);
  for (const glm::uvec3& t : triangles) used[t.x] = used[t.y] = used[t.z] = true;
  return used;
}

double enclosed_volume(const TriangleMesh& mesh) {
  double volume = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    volume += glm::dot(mesh.vertices[t.x], glm::cross(mesh.vertices[t.y], mesh.vertices[t.z]));
  }
  return volume;
}

}  // namespace tolvol
