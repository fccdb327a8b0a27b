// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/triangle_mesh.h"

#include <bit>
#include <cmath>
#include <limits>
#include <sstream>
#include <unordered_map>

#include "reference/errors.h"

namespace tolvol {

void validate(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles) {
  if (vertices.empty()) throw InvalidInput("the mesh has no vertices");
  if (triangles.empty()) throw InvalidInput("the mesh has no faces");
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const glm::dvec3& p = vertices[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      std::ostringstream text;
      text << "vertex " << i << " is not finite (" << p.x << ", " << p.y << ", " << p.z << ")";
      throw InvalidInput(text.str());
    }
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      if (triangles[i][k] >= vertices.size()) {
        std::ostringstream text;
        text << "triangle " << i << " uses vertex " << triangles[i][k] << ", but there are only " << vertices.size();
        throw InvalidInput(text.str());
      }
    }
  }
}

std::vector<bool> used_vertices(std::size_t vertex_count, std::span<const glm::uvec3> triangles) {
  std::vector<bool> used(vertex_count, false);
  for (const glm::uvec3& t : triangles) used[t.x] = used[t.y] = used[t.z] = true;
  return used;
}

std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::dvec3> vertices) {
  struct Hash {
    std::size_t operator()(const glm::dvec3& p) const {
      std::uint64_t h = 0;
      for (int k = 0; k < 3; ++k) {
        h ^= std::bit_cast<std::uint64_t>(p[k] + 0.0);  // -0 + 0 is 0: equal numbers hash alike
        h *= 0x9E3779B97F4A7C15u;
        h ^= h >> 32;
      }
      return h;
    }
  };
  std::unordered_map<glm::dvec3, std::uint32_t, Hash> first(vertices.size() * 2);
  std::vector<std::uint32_t> representative(vertices.size());
  for (std::uint32_t i = 0; i < vertices.size(); ++i)
    representative[i] = first.try_emplace(vertices[i], i).first->second;
  return representative;
}

}  // namespace tolvol
