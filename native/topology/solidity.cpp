// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/solidity.h"

#include <numeric>
#include <vector>

#include "base/call.h"
#include "base/union_find.h"
#include "geometry/triangle_mesh.h"
#include "geometry/weld.h"
#include "topology/sides.h"

namespace tolvol {

Solidity solidity(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, Team& team) {
  Solidity found;
  const std::vector<std::uint32_t> position = weld_equal_positions(vertices, team);
  std::vector<std::uint32_t> at;       // For each corner of a triangle that counts.
  std::vector<std::uint32_t> counted;  // The triangles that count.
  at.reserve(3 * triangles.size());
  for (const glm::uvec3& t : triangles) {
    poll_at(at.size());
    const std::uint32_t a = position[t.x], b = position[t.y], c = position[t.z];
    if (a == b || b == c || c == a) {
      ++found.degenerate_triangles;
    } else {
      at.insert(at.end(), {a, b, c});
      counted.push_back(static_cast<std::uint32_t>(at.size() / 3 + found.degenerate_triangles - 1));
    }
  }
  UnionFind loops(vertices.size()), fans(at.size()), shells(at.size() / 3);
  std::vector<bool> on_boundary(vertices.size(), false);
  std::vector<std::uint32_t> sides(at.size());
  std::iota(sides.begin(), sides.end(), 0u);
  const auto end_of = [&](std::uint32_t corner) { return at[corner]; };
  by_ends(sides, vertices.size(), team, end_of, [&](const std::vector<std::uint32_t>& alike) {
    if (alike.size() == 1) {
      const std::uint32_t from = at[alike[0]], to = at[next_corner(alike[0])];
      ++found.open_edges;
      loops.join(from, to);
      on_boundary[from] = on_boundary[to] = true;
    }
    found.non_manifold_edges += alike.size() > 2;
    for (std::size_t i = 1; i < alike.size(); ++i) {
      const std::uint32_t a = alike[i - 1], b = alike[i];
      const bool same_direction = at[a] == at[b];
      found.misoriented_edges += same_direction && alike.size() == 2;
      fans.join(a, same_direction ? b : next_corner(b));
      fans.join(next_corner(a), same_direction ? next_corner(b) : b);
      shells.join(a / 3, b / 3);
    }
  });

  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    poll_at(v);
    found.boundary_loops += on_boundary[v] && loops.find(v) == v;
  }
  std::vector<std::uint8_t> fans_at(vertices.size(), 0);
  for (std::uint32_t corner = 0; corner < at.size(); ++corner) {
    poll_at(corner);
    std::uint8_t& fans_here = fans_at[at[corner]];
    if (fans.find(corner) != corner || fans_here == 2) continue;
    ++fans_here;
    found.non_manifold_vertices += fans_here == 2;
  }
  found.shell_of.resize(triangles.size());
  std::iota(found.shell_of.begin(), found.shell_of.end(), 0u);
  for (std::uint32_t t = 0; t < counted.size(); ++t) {
    found.shells += shells.find(t) == t;
    found.shell_of[counted[t]] = counted[shells.find(t)];
  }
  return found;
}

}  // namespace tolvol
