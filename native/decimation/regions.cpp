// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/regions.h"

#include <algorithm>
#include <limits>
#include <span>

namespace tolvol {

std::uint32_t Regions::of_edge(const BoundedMesh& mesh, std::uint32_t edge) const {
  const auto h = mesh.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  const std::uint32_t a = of_vertex_[mesh.from(h)], b = of_vertex_[mesh.to(h)];
  return a == b ? a : kNone;
}

/// Level by level, each part with more than `most` vertices is cut in two. Orders `vertices` by region.
void Regions::cut(const BoundedMesh& mesh, std::vector<std::uint32_t>& vertices, std::size_t most, double first,
                  Team& team) {
  struct Part {
    std::uint32_t node;
    Box cell;
    std::span<std::uint32_t> vertices;
  };
  struct Halves {
    int axis;
    double at;
    std::size_t place;  ///< of the first vertex of the upper half
  };
  constexpr double kFar = std::numeric_limits<double>::infinity();
  nodes_ = {{}};
  std::vector<Part> parts{{0, {glm::dvec3(-kFar), glm::dvec3(kFar)}, vertices}};
  double share = first;
  while (std::ranges::any_of(parts, [&](const Part& part) { return part.vertices.size() > most; })) {
    std::vector<Halves> halves(parts.size());
    team.run(parts.size(), 1, [&](std::size_t i, std::size_t) {
      const std::span<std::uint32_t> all = parts[i].vertices;
      if (all.size() <= most) return;
      Box box;
      for (const std::uint32_t v : all) box.add(mesh.stored(v));
      const glm::dvec3 size = box.upper - box.lower;
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      const std::size_t place =
          std::clamp<std::size_t>(static_cast<std::size_t>(share * static_cast<double>(all.size())), 1, all.size() - 1);
      const auto middle = all.begin() + static_cast<std::ptrdiff_t>(place);
      std::nth_element(all.begin(), middle, all.end(), [&](std::uint32_t a, std::uint32_t b) {
        const double x = mesh.stored(a)[axis], y = mesh.stored(b)[axis];
        return x < y || (x == y && a < b);
      });
      halves[i] = {axis, mesh.stored(*middle)[axis], place};
    });
    std::vector<Part> next;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].vertices.size() <= most) {
        next.push_back(parts[i]);
        continue;
      }
      const auto [axis, at, place] = halves[i];
      const auto below = static_cast<std::uint32_t>(nodes_.size());
      nodes_[parts[i].node] = {axis, at, below, kNone};
      nodes_.resize(nodes_.size() + 2);
      Part lower{below, parts[i].cell, parts[i].vertices.first(place)};
      Part upper{below + 1, parts[i].cell, parts[i].vertices.subspan(place)};
      lower.cell.upper[axis] = upper.cell.lower[axis] = at;
      next.push_back(lower), next.push_back(upper);
    }
    parts.swap(next);
    share = 0.5;
  }
  for (const Part& part : parts) {
    nodes_[part.node].region = count();
    for (const std::uint32_t v : part.vertices) of_vertex_[v] = count();
    cells_.push_back(part.cell);
  }
}

Regions::Regions(const BoundedMesh& mesh, std::size_t most, double first, Team& team) {
  const OpenMesh::TriConnectivity& connectivity = mesh.connectivity();
  of_vertex_.assign(connectivity.n_vertices(), kNone);
  std::vector<std::uint32_t> alive;
  for (std::uint32_t v = 0; v < of_vertex_.size(); ++v) {
    if (!connectivity.status(BoundedMesh::handle(v)).deleted()) alive.push_back(v);
  }
  cut(mesh, alive, most, first, team);
  std::vector<std::uint32_t> rim;
  for (const std::uint32_t v : alive) {
    if (mesh.joined(v)) rim.push_back(v);
  }
  for (const auto e : connectivity.edges()) {
    const auto h = connectivity.halfedge_handle(e, 0);
    const std::uint32_t a = mesh.from(h), b = mesh.to(h);
    if (of_vertex_[a] != of_vertex_[b]) rim.push_back(a), rim.push_back(b);
  }
  for (const std::uint32_t v : rim) of_vertex_[v] = kNone;
}

}  // namespace tolvol
