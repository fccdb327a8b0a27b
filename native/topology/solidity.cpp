// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/solidity.h"

#include <algorithm>
#include <tuple>
#include <vector>

#include "base/call.h"
#include "base/union_find.h"
#include "geometry/triangle_mesh.h"
#include "topology/sort_by.h"

namespace tolvol {
namespace {

/// The edge of triangle corner / 3 from this corner to the next.
struct Side {
  std::uint32_t low, high;  ///< are the positions of its ends
  std::uint32_t corner;
};

std::uint32_t next(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

}  // namespace

Solidity solidity(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, Team& team) {
  Solidity found;
  const std::vector<std::uint32_t> position = weld_equal_positions(vertices);
  std::vector<std::uint32_t> at;  // For each corner of a triangle that counts.
  at.reserve(3 * triangles.size());
  for (const glm::uvec3& t : triangles) {
    poll_at(at.size());
    const std::uint32_t a = position[t.x], b = position[t.y], c = position[t.z];
    if (a == b || b == c || c == a) {
      ++found.degenerate_triangles;
    } else {
      at.insert(at.end(), {a, b, c});
    }
  }
  std::vector<Side> sides(at.size());
  for (std::uint32_t corner = 0; corner < at.size(); ++corner) {
    poll_at(corner);
    sides[corner] = {std::min(at[corner], at[next(corner)]), std::max(at[corner], at[next(corner)]), corner};
  }
  const auto key = [](const Side& s) { return std::tuple(s.low, s.high, s.corner); };
  sort_by(
      sides, vertices.size(), team, [](const Side& s) { return s.low; },
      [&](const Side& a, const Side& b) { return key(a) < key(b); });

  UnionFind loops(vertices.size()), fans(at.size()), shells(at.size() / 3);
  std::vector<bool> on_boundary(vertices.size(), false);
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    poll_at(begin);
    const Side& first = sides[begin];
    while (end < sides.size() && sides[end].low == first.low && sides[end].high == first.high) ++end;
    if (end - begin == 1) {
      ++found.open_edges;
      loops.join(first.low, first.high);
      on_boundary[first.low] = true;
    }
    found.non_manifold_edges += end - begin > 2;
    for (std::size_t i = begin + 1; i < end; ++i) {
      const std::uint32_t a = sides[i - 1].corner, b = sides[i].corner;
      const bool same_direction = at[a] == at[b];
      found.misoriented_edges += same_direction && end - begin == 2;
      fans.join(a, same_direction ? b : next(b));
      fans.join(next(a), same_direction ? next(b) : b);
      shells.join(a / 3, b / 3);
    }
  }

  std::vector<bool> is_counted(vertices.size(), false);
  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    poll_at(v);
    if (!on_boundary[v] || is_counted[loops.find(v)]) continue;
    is_counted[loops.find(v)] = true;
    ++found.boundary_loops;
  }
  std::vector<std::uint8_t> fans_at(vertices.size(), 0);
  for (std::uint32_t corner = 0; corner < at.size(); ++corner) {
    poll_at(corner);
    if (fans.find(corner) == corner && fans_at[at[corner]] < 2 && ++fans_at[at[corner]] == 2) {
      ++found.non_manifold_vertices;
    }
  }
  for (std::uint32_t t = 0; 3 * t < at.size(); ++t) found.shells += shells.find(t) == t;
  return found;
}

}  // namespace tolvol
