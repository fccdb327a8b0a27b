// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/regions.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace tolvol {
namespace {

using Vertices = std::span<std::uint32_t>;

/// Cuts the vertices in two across the longest side of their box.
std::pair<Vertices, Vertices> halves(const BoundedMesh& mesh, Vertices vertices, double share) {
  Box box;
  for (const std::uint32_t v : vertices) box.add(mesh.position(v));
  const glm::dvec3 size = box.upper - box.lower;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t place = std::clamp<std::size_t>(
      static_cast<std::size_t>(share * static_cast<double>(vertices.size())), 1, vertices.size() - 1);
  std::nth_element(vertices.begin(), vertices.begin() + static_cast<std::ptrdiff_t>(place), vertices.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     const double x = mesh.position(a)[axis], y = mesh.position(b)[axis];
                     return x < y || (x == y && a < b);
                   });
  return {vertices.first(place), vertices.subspan(place)};
}

/// Cuts again and again until no part has more than `most` vertices. The first time the share `first` of them goes to
/// one side.
std::vector<Vertices> pieces(const BoundedMesh& mesh, Vertices all, std::size_t most, double first, Team& team) {
  std::vector<Vertices> found{all};
  double share = first;
  while (std::ranges::any_of(found, [&](Vertices vertices) { return vertices.size() > most; })) {
    std::vector<std::pair<Vertices, Vertices>> cut(found.size());
    team.run(found.size(), 1, [&](std::size_t i, std::size_t) {
      cut[i] = found[i].size() > most ? halves(mesh, found[i], share) : std::pair{found[i], Vertices{}};
    });
    found.clear();
    for (const auto& [one, other] : cut) {
      found.push_back(one);
      if (!other.empty()) found.push_back(other);
    }
    share = 0.5;
  }
  return found;
}

}  // namespace

std::uint32_t Regions::of_edge(const BoundedMesh& mesh, std::uint32_t edge) const {
  const auto h = mesh.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  const std::uint32_t a = of_vertex[mesh.from(h)], b = of_vertex[mesh.to(h)];
  return a == b ? a : kNone;
}

Regions regions(const BoundedMesh& mesh, std::size_t most, double first, Team& team) {
  Regions out;
  const OpenMesh::TriConnectivity& connectivity = mesh.connectivity();
  out.of_vertex.assign(connectivity.n_vertices(), Regions::kNone);
  std::vector<std::uint32_t> alive, rim;
  for (std::uint32_t v = 0; v < out.of_vertex.size(); ++v) {
    if (connectivity.status(BoundedMesh::handle(v)).deleted()) continue;
    alive.push_back(v);
    if (mesh.joined(v)) rim.push_back(v);
  }
  for (const Vertices vertices : pieces(mesh, alive, most, first, team)) {
    for (const std::uint32_t v : vertices) out.of_vertex[v] = out.count;
    ++out.count;
  }
  for (const auto e : connectivity.edges()) {
    const auto h = connectivity.halfedge_handle(e, 0);
    const std::uint32_t a = mesh.from(h), b = mesh.to(h);
    if (out.of_vertex[a] != out.of_vertex[b]) rim.push_back(a), rim.push_back(b);
  }
  for (const std::uint32_t v : rim) out.of_vertex[v] = Regions::kNone;
  return out;
}

}  // namespace tolvol
