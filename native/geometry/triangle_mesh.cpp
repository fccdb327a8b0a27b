// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/triangle_mesh.h"

#include <bit>
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

std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::dvec3> vertices) {
  // The table uses open addressing and is at most half full.
  constexpr std::uint32_t kFree = 0xFFFFFFFFu;
  std::vector<std::uint32_t> first(std::bit_ceil(2 * vertices.size() + 1), kFree);
  const int bits = std::countr_zero(first.size());
  const auto place_of = [&](const glm::dvec3& p) {
    std::uint64_t h = 0;
    for (int k = 0; k < 3; ++k) {
      h ^= h >> 32;
      h ^= std::bit_cast<std::uint64_t>(p[k] + 0.0);  // -0 + 0 is 0, so that equal numbers hash alike
      h *= 0x9E3779B97F4A7C15u;
    }
    return static_cast<std::size_t>(h >> (64 - bits));  // the highest bits depend on all others
  };
  std::vector<std::uint32_t> representative(vertices.size());
  for (std::uint32_t i = 0; i < vertices.size(); ++i) {
    poll_at(i);
    std::size_t place = place_of(vertices[i]);
    while (first[place] != kFree && vertices[first[place]] != vertices[i]) place = (place + 1) & (first.size() - 1);
    if (first[place] == kFree) first[place] = i;
    representative[i] = first[place];
  }
  return representative;
}

}  // namespace tolvol
