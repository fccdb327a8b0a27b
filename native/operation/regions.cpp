// SPDX-License-Identifier: GPL-3.0-or-later
#include "operation/regions.h"

#include <algorithm>
#include <span>

#include "reference/triangle_mesh.h"

namespace tolvol {
namespace {

class Cutter {
 public:
  Cutter(const BoundedMesh& mesh, std::size_t most, Regions& out) : mesh_(mesh), most_(most), out_(out) {}

  void cut(std::span<std::uint32_t> vertices, double share) {
    if (vertices.size() <= most_) {
      for (const std::uint32_t v : vertices) out_.of_vertex[v] = out_.count;
      ++out_.count;
      return;
    }
    Box box;
    for (const std::uint32_t v : vertices) box.add(mesh_.position(v));
    const glm::dvec3 size = box.upper - box.lower;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t place = std::clamp<std::size_t>(
        static_cast<std::size_t>(share * static_cast<double>(vertices.size())), 1, vertices.size() - 1);
    std::nth_element(vertices.begin(), vertices.begin() + static_cast<std::ptrdiff_t>(place), vertices.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double x = mesh_.position(a)[axis], y = mesh_.position(b)[axis];
                       return x < y || (x == y && a < b);
                     });
    cut(vertices.first(place), 0.5);
    cut(vertices.subspan(place), 0.5);
  }

 private:
  const BoundedMesh& mesh_;
  std::size_t most_;
  Regions& out_;
};

}  // namespace

std::uint32_t Regions::of_edge(const BoundedMesh& mesh, std::uint32_t edge) const {
  const auto h = mesh.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  const std::uint32_t a = of_vertex[mesh.from(h)], b = of_vertex[mesh.to(h)];
  return a == b ? a : kNone;
}

Regions regions(const BoundedMesh& mesh, std::size_t most, double first) {
  Regions out;
  const OpenMesh::TriConnectivity& connectivity = mesh.connectivity();
  out.of_vertex.assign(connectivity.n_vertices(), Regions::kNone);
  std::vector<std::uint32_t> alive, rim;
  for (std::uint32_t v = 0; v < out.of_vertex.size(); ++v) {
    if (connectivity.status(BoundedMesh::handle(v)).deleted()) continue;
    alive.push_back(v);
    if (mesh.has_copies(v)) rim.push_back(v);
  }
  Cutter(mesh, most, out).cut(alive, first);
  for (const auto e : connectivity.edges()) {
    const auto h = connectivity.halfedge_handle(e, 0);
    const std::uint32_t a = mesh.from(h), b = mesh.to(h);
    if (out.of_vertex[a] != out.of_vertex[b]) rim.push_back(a), rim.push_back(b);
  }
  for (const std::uint32_t v : rim) out.of_vertex[v] = Regions::kNone;
  return out;
}

}  // namespace tolvol
