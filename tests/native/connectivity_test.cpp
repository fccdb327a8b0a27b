// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/connectivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <stdexcept>
#include <vector>

#include "shapes.h"
#include "topology/manifold_cut.h"

namespace {

using namespace tolvol;
using OpenMesh::TriConnectivity;

TriConnectivity one_by_one(std::size_t vertices, const std::vector<glm::uvec3>& triangles) {
  TriConnectivity mesh;
  for (std::size_t i = 0; i < vertices; ++i) mesh.new_vertex();
  for (const glm::uvec3& t : triangles) {
    const OpenMesh::VertexHandle corners[3] = {OpenMesh::VertexHandle(int(t.x)), OpenMesh::VertexHandle(int(t.y)),
                                               OpenMesh::VertexHandle(int(t.z))};
    EXPECT_TRUE(mesh.add_face(corners, 3).is_valid());
  }
  return mesh;
}

/// The first two sides between the same vertices are mates.
std::vector<std::uint32_t> mates_of(const std::vector<glm::uvec3>& triangles) {
  std::vector<std::uint32_t> mates(3 * triangles.size(), CutMesh::kNone);
  std::map<std::pair<unsigned, unsigned>, std::uint32_t> first;
  for (std::uint32_t s = 0; s < mates.size(); ++s) {
    const auto [other, added] = first.emplace(std::minmax(triangles[s / 3][s % 3], triangles[s / 3][(s + 1) % 3]), s);
    if (added || mates[other->second] != CutMesh::kNone) continue;
    mates[s] = other->second, mates[other->second] = s;
  }
  return mates;
}

TriConnectivity at_once(std::size_t vertices, const std::vector<glm::uvec3>& triangles,
                        const std::vector<std::uint32_t>& mates) {
  TriConnectivity mesh;
  Team team(2);
  connect(vertices, triangles, mates, mesh, team);
  return mesh;
}

TriConnectivity at_once(std::size_t vertices, const std::vector<glm::uvec3>& triangles) {
  return at_once(vertices, triangles, mates_of(triangles));
}

void expect_same(const TriConnectivity& a, const TriConnectivity& b) {
  ASSERT_EQ(a.n_vertices(), b.n_vertices());
  ASSERT_EQ(a.n_edges(), b.n_edges());
  ASSERT_EQ(a.n_faces(), b.n_faces());
  for (const auto h : a.halfedges()) {
    ASSERT_EQ(a.to_vertex_handle(h), b.to_vertex_handle(h)) << "halfedge " << h.idx();
    ASSERT_EQ(a.face_handle(h), b.face_handle(h)) << "halfedge " << h.idx();
    ASSERT_EQ(a.next_halfedge_handle(h), b.next_halfedge_handle(h)) << "halfedge " << h.idx();
    ASSERT_EQ(a.prev_halfedge_handle(h), b.prev_halfedge_handle(h)) << "halfedge " << h.idx();
  }
  for (const auto v : a.vertices()) ASSERT_EQ(a.halfedge_handle(v), b.halfedge_handle(v)) << "vertex " << v.idx();
  for (const auto f : a.faces()) ASSERT_EQ(a.halfedge_handle(f), b.halfedge_handle(f)) << "face " << f.idx();
}

TEST(Connectivity, IsWhatTheKernelMakesFaceByFace) {
  const TriangleMesh triangle{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{2, 0, 1}}};
  const TriangleMesh nothing{{{0, 0, 0}}, {}};
  for (const TriangleMesh& mesh : {shapes::torus(12), shapes::torus(60), shapes::grid(9), shapes::box(4), triangle,
                                   nothing, shapes::joined(shapes::grid(5), shapes::torus(7))}) {
    expect_same(one_by_one(mesh.vertices.size(), mesh.triangles), at_once(mesh.vertices.size(), mesh.triangles));
  }
}

TEST(Connectivity, TrianglesInAnyOrderAndRaggedHoles) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    TriangleMesh mesh = seed % 2 ? shapes::torus(10) : shapes::grid(10);
    std::mt19937 engine(seed);
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), engine);
    for (glm::uvec3& t : mesh.triangles) {
      for (unsigned turns = engine() % 3; turns > 0; --turns) t = {t.y, t.z, t.x};
    }
    mesh.triangles.resize(mesh.triangles.size() * (1 + seed % 4) / 4);
    Team team(1);
    const CutMesh cut = cut_to_manifold(mesh.vertices, mesh.triangles, team);
    EXPECT_EQ(cut.mates, mates_of(cut.triangles));
    expect_same(one_by_one(cut.vertex_input.size(), cut.triangles),
                at_once(cut.vertex_input.size(), cut.triangles, cut.mates));
  }
}

// Until nothing is left to collapse, in any order: boundaries shrink to triangles, and bodies to tetrahedra.
TEST(Connectivity, CollapsesAsTheKernelDoes) {
  int collapses = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    TriangleMesh mesh = seed % 3 == 0 ? shapes::torus(8) : seed % 3 == 1 ? shapes::grid(9) : shapes::box(4);
    std::mt19937 engine(seed);
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), engine);
    mesh.triangles.resize(mesh.triangles.size() * (2 + seed % 2) / 3);
    Team team(1);
    const CutMesh cut = cut_to_manifold(mesh.vertices, mesh.triangles, team);
    TriConnectivity ours = at_once(cut.vertex_input.size(), cut.triangles, cut.mates);
    ours.request_vertex_status(), ours.request_edge_status(), ours.request_face_status();
    ours.request_halfedge_status();
    TriConnectivity kernel = ours;
    std::vector<int> order(ours.n_halfedges());
    std::iota(order.begin(), order.end(), 0);
    for (bool changed = true; changed;) {
      changed = false;
      std::shuffle(order.begin(), order.end(), engine);
      for (const int i : order) {
        const OpenMesh::HalfedgeHandle h(i);
        if (kernel.status(kernel.edge_handle(h)).deleted() || !kernel.is_collapse_ok(h)) continue;
        kernel.collapse(h);
        collapse(ours, h);
        ASSERT_NO_FATAL_FAILURE(expect_same(kernel, ours)) << "seed " << seed << ", halfedge " << i;
        ++collapses;
        changed = true;
      }
    }
    for (const auto e : kernel.all_edges()) ASSERT_EQ(kernel.status(e).deleted(), ours.status(e).deleted());
    for (const auto f : kernel.all_faces()) ASSERT_EQ(kernel.status(f).deleted(), ours.status(f).deleted());
    for (const auto v : kernel.all_vertices()) ASSERT_EQ(kernel.status(v).deleted(), ours.status(v).deleted());
    for (const auto h : kernel.all_halfedges()) ASSERT_EQ(kernel.status(h).deleted(), ours.status(h).deleted());
  }
  EXPECT_GT(collapses, 1000);
}

TEST(Connectivity, RefusesWhatIsNoOrientedManifold) {
  EXPECT_THROW(at_once(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}), std::logic_error);  // three faces at an edge
  EXPECT_THROW(at_once(4, {{0, 1, 2}, {0, 1, 3}}), std::logic_error);             // two the same way around
  EXPECT_THROW(at_once(5, {{0, 1, 2}, {0, 3, 4}}), std::logic_error);             // two boundaries at a vertex
  EXPECT_THROW(at_once(7, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}, {0, 4, 5}, {0, 5, 6}, {0, 6, 4}, {4, 6, 5}}),
               std::logic_error);  // two closed fans
  EXPECT_THROW(
      at_once(4, {{0, 1, 2}, {1, 0, 3}}, {1, 0, CutMesh::kNone, CutMesh::kNone, CutMesh::kNone, CutMesh::kNone}),
      std::logic_error);
  constexpr std::uint32_t kNone = CutMesh::kNone;
  EXPECT_THROW(at_once(4, {{0, 1, 2}, {1, 0, 3}}, {3, kNone, kNone, kNone, kNone, kNone}), std::logic_error);
  EXPECT_THROW(at_once(4, {{0, 1, 2}, {1, 0, 3}}, {99, kNone, kNone, kNone, kNone, kNone}), std::logic_error);
  EXPECT_THROW(at_once(4, {{0, 1, 2}, {1, 0, 3}}, {}), std::logic_error);
  TriangleMesh large = shapes::torus(60);
  std::swap(large.triangles.back().x, large.triangles.back().y);
  EXPECT_THROW(at_once(large.vertices.size(), large.triangles), std::logic_error);
}

}  // namespace
