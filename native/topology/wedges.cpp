// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/wedges.h"

#include <algorithm>
#include <string_view>
#include <unordered_map>

#include "base/call.h"
#include "base/union_find.h"

namespace tolvol {

std::vector<std::uint32_t> wedge_labels(std::span<const glm::uvec3> triangles, std::span<const float> values,
                                        std::size_t width) {
  // The key is the vertex and the values, as bytes. -0 and 0 are one value.
  std::vector<float> keys((width + 1) * triangles.size() * 3);
  std::unordered_map<std::string_view, std::uint32_t> first;
  first.reserve(triangles.size() * 3);
  std::vector<std::uint32_t> labels(triangles.size() * 3);
  for (std::uint32_t corner = 0; corner < labels.size(); ++corner) {
    float* const key = &keys[(width + 1) * corner];
    const std::uint32_t vertex = triangles[corner / 3][corner % 3];
    static_assert(sizeof vertex == sizeof *key);
    __builtin_memcpy(key, &vertex, sizeof vertex);
    for (std::size_t i = 0; i < width; ++i) key[i + 1] = values[width * corner + i] + 0.0f;
    const std::string_view bytes(reinterpret_cast<const char*>(key), (width + 1) * sizeof *key);
    labels[corner] = first.try_emplace(bytes, corner).first->second;
  }
  return labels;
}

std::vector<std::uint32_t> island_labels(std::span<const glm::uvec3> triangles, std::span<const glm::uvec3> wedges) {
  struct Side {
    std::uint64_t edge;
    std::uint32_t triangle, low, high;  // low and high are the wedges at the lower and the higher vertex
  };
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    poll_at(t);
    for (int k = 0; k < 3; ++k) {
      std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3], wa = wedges[t][k], wb = wedges[t][(k + 1) % 3];
      if (a > b) std::swap(a, b), std::swap(wa, wb);
      sides.push_back({(static_cast<std::uint64_t>(a) << 32) | b, t, wa, wb});
    }
  }
  std::size_t compared = 0;
  std::sort(sides.begin(), sides.end(), [&](const Side& a, const Side& b) {
    poll_at(++compared);
    return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle;
  });
  UnionFind islands(triangles.size());
  for (std::size_t i = 1; i < sides.size(); ++i) {
    poll_at(i);
    const Side &a = sides[i - 1], &b = sides[i];
    if (a.edge == b.edge && a.low == b.low && a.high == b.high) islands.join(a.triangle, b.triangle);
  }
  std::vector<std::uint32_t> labels(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    poll_at(t);
    labels[t] = islands.find(t);
  }
  return labels;
}

}  // namespace tolvol
