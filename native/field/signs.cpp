// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/signs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/call.h"
#include "base/parallel.h"

namespace tolvol {

void sign_by_triangle(const TriangleMesh& reference, const Pseudonormals& normals, const DistanceGrid& grid,
                      std::span<float> distance, unsigned threads) {
  parallel_for(static_cast<std::size_t>(grid.nodes.z), 1, threads, [&](std::size_t z, std::size_t) {
    for (int y = 0; y < grid.nodes.y; ++y) {
      poll();
      const std::size_t row = grid.index(0, y, static_cast<int>(z));
      for (int x = 0; x < grid.nodes.x; ++x) {
        const std::uint32_t id = grid.triangle[row + x];
        if (id == DistanceGrid::kNone) continue;
        const glm::uvec3 t = reference.triangles[id];
        const glm::dvec3 p = grid.origin + grid.spacing * glm::dvec3(x, y, z);
        const ClosestPoint q =
            closest_point(p, reference.vertices[t.x], reference.vertices[t.y], reference.vertices[t.z]);
        if (normals.inside(p, id, q)) distance[row + x] = -distance[row + x];
      }
    }
  });
}

void spread_signs(const DistanceGrid& grid, std::vector<std::uint8_t> known, std::span<float> distance) {
  const std::size_t strides[] = {1, grid.index(0, 1, 0), grid.index(0, 0, 1)};
  // The first sweep goes towards +x, +y, +z and reaches the nodes ahead of a known node. The second goes back.
  for (const bool back : {false, true}) {
    const auto at = [&](int i, int count) { return back ? count - 1 - i : i; };
    for (int k = 0; k < grid.nodes.z; ++k) {
      for (int j = 0; j < grid.nodes.y; ++j) {
        poll();
        for (int i = 0; i < grid.nodes.x; ++i) {
          const std::size_t node = grid.index(at(i, grid.nodes.x), at(j, grid.nodes.y), at(k, grid.nodes.z));
          if (known[node]) continue;
          const bool has_before[] = {i > 0, j > 0, k > 0};
          for (int axis = 0; axis < 3 && !known[node]; ++axis) {
            if (!has_before[axis]) continue;
            const std::size_t before = back ? node + strides[axis] : node - strides[axis];
            if (!known[before]) continue;
            distance[node] = std::copysign(distance[node], distance[before]);
            known[node] = 1;
          }
        }
      }
    }
  }
}

std::vector<float> signed_distance(const TriangleMesh& reference, const DistanceGrid& grid, unsigned threads) {
  return grid.is_signed ? copied(grid.distance) : signed_distance(reference, Pseudonormals(reference), grid, threads);
}

std::vector<float> signed_distance(const TriangleMesh& reference, const Pseudonormals& normals,
                                   const DistanceGrid& grid, unsigned threads) {
  std::vector<float> result = copied(grid.distance);
  if (grid.is_signed) return result;
  sign_by_triangle(reference, normals, grid, result, threads);
  std::vector<std::uint8_t> known;
  fill(known, grid.triangle.size(), std::uint8_t{0});
  for (std::size_t i = 0; i < known.size(); ++i) {
    poll_at(i);
    known[i] = grid.triangle[i] != DistanceGrid::kNone;
  }
  spread_signs(grid, std::move(known), result);
  return result;
}

}  // namespace tolvol
