// SPDX-License-Identifier: GPL-3.0-or-later
/// The corners of triangles that are seen for the first time.
#pragma once

#include <bit>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// Tells which corners of triangles no earlier triangle has had, by their places. The distance at a corner that many
/// triangles share, near which there may be as many of the other mesh, is thus looked at once.
class FreshCorners {
 public:
  /// Keeps a reference to the mesh.
  explicit FreshCorners(const TriangleMesh& mesh)
      : mesh_(mesh), slots_(std::bit_ceil(2 * mesh.vertices.size() + 1), kEmpty) {}

  /// Returns a bit for each corner of a triangle, from the lowest on.
  unsigned of(std::uint32_t triangle) {
    unsigned fresh = 0;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t vertex = mesh_.triangles[triangle][k];
      std::uint32_t& slot = slots_[hash_of(mesh_.vertices[vertex]) & (slots_.size() - 1)];
      // Of two places with one slot, which are few, that of the later triangles counts as fresh each time.
      if (slot != kEmpty && mesh_.vertices[slot] == mesh_.vertices[vertex]) continue;
      if (slot == kEmpty) slot = vertex;
      fresh |= 1u << k;
    }
    return fresh;
  }

 private:
  static std::uint64_t hash_of(const glm::dvec3& p) {
    std::uint64_t hash = 0;
    for (int i = 0; i < 3; ++i) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(p[i] + 0.0)) * 0x9E3779B97F4A7C15u;  // + 0.0 makes 0 of -0
      hash ^= hash >> 32;
    }
    return hash;
  }

  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFu;

  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> slots_;
};

}  // namespace tolvol
