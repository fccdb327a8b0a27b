// SPDX-License-Identifier: GPL-3.0-or-later
// Face by face the kernel looks for each edge around its vertex, and links the boundary anew; here sides find each
// other in one pass, and the boundary is linked once.
#include "operation/connectivity.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "operation/sort_by.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

void require_manifold(bool holds) {
  if (!holds) throw std::logic_error("the triangles are not an oriented manifold");
}

/// A side is the edge of triangle side / 3 from corner side % 3 to the next.
class Sides {
 public:
  explicit Sides(std::span<const glm::uvec3> triangles) : triangles_(triangles) {}

  std::uint32_t count() const { return static_cast<std::uint32_t>(3 * triangles_.size()); }
  static std::uint32_t next(std::uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; }
  std::uint32_t from(std::uint32_t side) const { return triangles_[side / 3][side % 3]; }
  std::uint32_t to(std::uint32_t side) const { return from(next(side)); }

  /// Per side: the other triangle's side on the same edge, or kNone.
  std::vector<std::uint32_t> mates() const {
    const auto ends = [&](std::uint32_t side) { return std::minmax({from(side), to(side)}); };
    std::vector<std::uint32_t> sorted(count()), mates(count(), kNone);
    std::iota(sorted.begin(), sorted.end(), 0u);
    sort_by(
        sorted, [&](std::uint32_t side) { return ends(side).first; },
        [&](std::uint32_t a, std::uint32_t b) { return ends(a) < ends(b); });
    for (std::uint32_t i = 1; i < count(); ++i) {
      const std::uint32_t s = sorted[i], other = sorted[i - 1];
      if (ends(s) != ends(other)) continue;
      require_manifold(from(s) == to(other) && mates[other] == kNone);
      mates[s] = other, mates[other] = s;
    }
    return mates;
  }

 private:
  std::span<const glm::uvec3> triangles_;
};

}  // namespace

void connect(std::size_t vertices, std::span<const glm::uvec3> triangles, OpenMesh::TriConnectivity& mesh) {
  using OpenMesh::FaceHandle;
  using OpenMesh::HalfedgeHandle;
  const auto vertex = [](std::uint32_t i) { return OpenMesh::VertexHandle(static_cast<int>(i)); };
  const Sides sides(triangles);
  const std::vector<std::uint32_t> mates = sides.mates();
  const auto first_of_edge = [&](std::uint32_t s) { return mates[s] == kNone || mates[s] > s; };
  std::size_t edges = 0;
  for (std::uint32_t s = 0; s < sides.count(); ++s) edges += first_of_edge(s);
  mesh.resize(vertices, edges, triangles.size());

  std::vector<HalfedgeHandle> halfedge(sides.count());
  int next = 0;
  for (std::uint32_t s = 0; s < sides.count(); ++s) {
    if (!first_of_edge(s)) continue;
    halfedge[s] = HalfedgeHandle(next++);
    const HalfedgeHandle other(next++);
    mesh.set_vertex_handle(halfedge[s], vertex(sides.to(s)));
    mesh.set_vertex_handle(other, vertex(sides.from(s)));
    if (mates[s] != kNone) halfedge[mates[s]] = other;
  }
  for (std::uint32_t s = 0; s < sides.count(); ++s) {
    const FaceHandle face(static_cast<int>(s / 3));
    mesh.set_face_handle(halfedge[s], face);
    mesh.set_next_halfedge_handle(halfedge[s], halfedge[Sides::next(s)]);
    mesh.set_halfedge_handle(vertex(sides.from(s)), halfedge[s]);
    mesh.set_halfedge_handle(face, halfedge[s]);
  }
  // A vertex on the boundary names the halfedge there.
  for (std::uint32_t s = 0; s < sides.count(); ++s) {
    if (mates[s] != kNone) continue;
    const auto v = vertex(sides.to(s));
    require_manifold(!mesh.is_boundary(v));
    mesh.set_halfedge_handle(v, mesh.opposite_halfedge_handle(halfedge[s]));
  }
  for (std::uint32_t s = 0; s < sides.count(); ++s) {
    if (mates[s] != kNone) continue;
    mesh.set_next_halfedge_handle(mesh.opposite_halfedge_handle(halfedge[s]),
                                  mesh.halfedge_handle(vertex(sides.from(s))));
  }
  // A walk around a vertex sees one fan of faces: no vertex may have another.
  std::size_t seen = 0;
  for (const auto v : mesh.vertices()) {
    for (const auto h : mesh.voh_range(v)) seen += !mesh.is_boundary(h);
  }
  require_manifold(seen == sides.count());
}

}  // namespace tolvol
