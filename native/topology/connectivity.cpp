// SPDX-License-Identifier: GPL-3.0-or-later
// When faces are added one by one, the kernel searches each edge around its vertex and links the boundary anew. Here
// each side knows its mate, and the boundary is linked once.
#include "topology/connectivity.h"

#include <atomic>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "base/call.h"
#include "topology/manifold_cut.h"
#include "topology/sides.h"

namespace tolvol {
namespace {

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
      if (other == CutMesh::kNone) continue;
      require_manifold(other < sides && mates[other] == s && from(s) == to(other) && to(s) == from(other));
    }
  });
  const auto first_of_edge = [&](std::uint32_t s) { return mates[s] == CutMesh::kNone || mates[s] > s; };
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
    if (mates[s] != CutMesh::kNone) halfedge[mates[s]] = other;
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
    if (mates[s] != CutMesh::kNone) continue;
    const auto v = vertex(to(s));
    require_manifold(!mesh.is_boundary(v));
    mesh.set_halfedge_handle(v, mesh.opposite_halfedge_handle(halfedge[s]));
  }
  for (std::uint32_t s = 0; s < sides; ++s) {
    poll_at(s);
    if (mates[s] != CutMesh::kNone) continue;
    mesh.set_next_halfedge_handle(mesh.opposite_halfedge_handle(halfedge[s]), mesh.halfedge_handle(vertex(from(s))));
  }
  // A walk around a vertex sees one fan of faces, and no vertex may have a second fan.
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

void collapse(OpenMesh::TriConnectivity& mesh, OpenMesh::HalfedgeHandle h) {
  using OpenMesh::HalfedgeHandle;
  const HalfedgeHandle o = mesh.opposite_halfedge_handle(h);
  const HalfedgeHandle hn = mesh.next_halfedge_handle(h), hp = mesh.prev_halfedge_handle(h);
  const HalfedgeHandle on = mesh.next_halfedge_handle(o), op = mesh.prev_halfedge_handle(o);
  const auto kept = mesh.to_vertex_handle(h), gone = mesh.from_vertex_handle(h);
  const auto left = mesh.to_vertex_handle(hn), right = mesh.to_vertex_handle(on);
  const bool has_left = mesh.face_handle(h).is_valid(), has_right = mesh.face_handle(o).is_valid();

  // A vertex on the boundary names the one boundary halfedge that leaves it. Any other vertex names the halfedge with
  // which the kernel's own collapse ends.
  const auto on_boundary = [&](auto vertex) { return mesh.is_boundary(mesh.halfedge_handle(vertex)); };
  HalfedgeHandle out = on_boundary(kept)   ? mesh.halfedge_handle(kept)
                       : on_boundary(gone) ? mesh.halfedge_handle(gone)
                                           : mesh.opposite_halfedge_handle(op);
  if (out == o) out = on;
  if (has_left && out == mesh.opposite_halfedge_handle(hp)) out = hn;
  if (has_left && !on_boundary(left)) mesh.set_halfedge_handle(left, mesh.opposite_halfedge_handle(hn));
  if (has_right && (!on_boundary(right) || mesh.halfedge_handle(right) == mesh.opposite_halfedge_handle(on))) {
    mesh.set_halfedge_handle(right, op);
  }

  HalfedgeHandle leaving = h;
  do {
    const HalfedgeHandle arriving = mesh.opposite_halfedge_handle(leaving);
    mesh.set_vertex_handle(arriving, kept);
    leaving = mesh.next_halfedge_handle(arriving);
  } while (leaving != h);
  mesh.set_next_halfedge_handle(hp, hn);
  mesh.set_next_halfedge_handle(op, on);
  const auto remove_edge = [&](HalfedgeHandle side) {
    for (const HalfedgeHandle s : {side, mesh.opposite_halfedge_handle(side)}) mesh.status(s).set_deleted(true);
    mesh.status(mesh.edge_handle(side)).set_deleted(true);
  };
  remove_edge(h);
  mesh.set_isolated(gone);
  mesh.status(gone).set_deleted(true);

  // A triangle beside the edge becomes two sides between the same vertices, and one of their edges is removed.
  const auto remove_triangle = [&](HalfedgeHandle goes, HalfedgeHandle stays) {
    const auto triangle = mesh.face_handle(goes);
    const HalfedgeHandle beyond = mesh.opposite_halfedge_handle(goes);
    const auto other = mesh.face_handle(beyond);
    mesh.set_next_halfedge_handle(stays, mesh.next_halfedge_handle(beyond));
    mesh.set_next_halfedge_handle(mesh.prev_halfedge_handle(beyond), stays);
    mesh.set_face_handle(stays, other);
    if (other.is_valid() && mesh.halfedge_handle(other) == beyond) mesh.set_halfedge_handle(other, stays);
    mesh.set_halfedge_handle(triangle, HalfedgeHandle());
    mesh.status(triangle).set_deleted(true);
    remove_edge(goes);
  };
  if (has_left) remove_triangle(hp, hn);
  if (has_right) remove_triangle(on, op);
  mesh.set_halfedge_handle(kept, out);
}

}  // namespace tolvol
