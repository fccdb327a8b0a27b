// SPDX-License-Identifier: GPL-3.0-or-later
// Face by face the kernel looks for each edge around its vertex, and links the boundary anew; here each side knows its
// mate, and the boundary is linked once.
#include "operation/connectivity.h"

#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "operation/manifold_cut.h"
#include "reference/call.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNone = CutMesh::kNone;

void require_manifold(bool holds) {
  if (!holds) throw std::logic_error("the triangles are not an oriented manifold");
}

}  // namespace

void connect(std::size_t vertices, std::span<const glm::uvec3> triangles, std::span<const std::uint32_t> mates,
             OpenMesh::TriConnectivity& mesh, Team& team) {
  using OpenMesh::FaceHandle;
  using OpenMesh::HalfedgeHandle;
  const auto vertex = [](std::uint32_t i) { return OpenMesh::VertexHandle(static_cast<int>(i)); };
  const auto sides = static_cast<std::uint32_t>(3 * triangles.size());
  require_manifold(mates.size() == sides);
  const auto from = [&](std::uint32_t s) { return triangles[s / 3][s % 3]; };
  const auto to = [&](std::uint32_t s) { return from(next_corner(s)); };
  team.run(sides, 4096, [&](std::size_t begin, std::size_t end) {
    for (auto s = static_cast<std::uint32_t>(begin); s < end; ++s) {
      const std::uint32_t other = mates[s];
      if (other == kNone) continue;
      require_manifold(other < sides && mates[other] == s && from(s) == to(other) && to(s) == from(other));
    }
  });
  const auto first_of_edge = [&](std::uint32_t s) { return mates[s] == kNone || mates[s] > s; };
  std::size_t edges = 0;
  for (std::uint32_t s = 0; s < sides; ++s) edges += first_of_edge(s);
  mesh.resize(vertices, edges, triangles.size());

  std::vector<HalfedgeHandle> halfedge(sides);
  int next = 0;
  for (std::uint32_t s = 0; s < sides; ++s) {
    poll_at(s);
    if (!first_of_edge(s)) continue;
    halfedge[s] = HalfedgeHandle(next++);
    const HalfedgeHandle other(next++);
    mesh.set_vertex_handle(halfedge[s], vertex(to(s)));
    mesh.set_vertex_handle(other, vertex(from(s)));
    if (mates[s] != kNone) halfedge[mates[s]] = other;
  }
  for (std::uint32_t s = 0; s < sides; ++s) {
    poll_at(s);
    const FaceHandle face(static_cast<int>(s / 3));
    mesh.set_face_handle(halfedge[s], face);
    mesh.set_next_halfedge_handle(halfedge[s], halfedge[next_corner(s)]);
    mesh.set_halfedge_handle(vertex(from(s)), halfedge[s]);
    mesh.set_halfedge_handle(face, halfedge[s]);
  }
  // A vertex on the boundary names the halfedge there.
  for (std::uint32_t s = 0; s < sides; ++s) {
    poll_at(s);
    if (mates[s] != kNone) continue;
    const auto v = vertex(to(s));
    require_manifold(!mesh.is_boundary(v));
    mesh.set_halfedge_handle(v, mesh.opposite_halfedge_handle(halfedge[s]));
  }
  for (std::uint32_t s = 0; s < sides; ++s) {
    poll_at(s);
    if (mates[s] != kNone) continue;
    mesh.set_next_halfedge_handle(mesh.opposite_halfedge_handle(halfedge[s]), mesh.halfedge_handle(vertex(from(s))));
  }
  // A walk around a vertex sees one fan of faces: no vertex may have another.
  std::atomic<std::size_t> seen = 0;
  team.run(vertices, 4096, [&](std::size_t begin, std::size_t end) {
    std::size_t here = 0;
    for (std::size_t v = begin; v < end; ++v) {
      for (const auto h : mesh.voh_range(vertex(static_cast<std::uint32_t>(v)))) here += !mesh.is_boundary(h);
    }
    seen += here;
  });
  require_manifold(seen == sides);
}

}  // namespace tolvol
