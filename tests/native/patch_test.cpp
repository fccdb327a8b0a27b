// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/patch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "certified_mesh.h"
#include "many.h"
#include "patches.h"

namespace {

using namespace tolvol;
using Corners = std::array<std::uint32_t, 3>;

constexpr unsigned kSide = 8;
constexpr std::uint32_t kMiddle = (kSide / 2) * (kSide + 1) + kSide / 2;

CertifiedMesh plate(std::vector<bool> pinned = {}) {
  const TriangleMesh grid = shapes::grid(kSide);
  return {grid, grid.vertices, 0.3, std::move(pinned)};
}

BoundedMesh::Halfedge edge_into(const BoundedMesh& mesh, std::uint32_t vertex) {
  return mesh.connectivity().find_halfedge(BoundedMesh::handle(vertex - 1), BoundedMesh::handle(vertex));
}

/// The corners as vertices of the mesh, the least first.
Corners turned(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  Corners corners{a, b, c};
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

Corners corners_of(const Patch& patch, const Patch::Face& face) {
  const auto id = [&](int k) { return patch.vertices()[face.corners[k]].id; };
  return turned(id(0), id(1), id(2));
}

void expect_linked(const Patch& patch) {
  for (std::uint32_t f = 0; f < patch.faces().size(); ++f) {
    const Patch::Face& face = patch.faces()[f];
    for (int k = 0; k < 3; ++k) {
      const auto& around = patch.vertices()[face.corners[k]].faces;
      EXPECT_EQ(std::ranges::count(around, f), 1);
      if (face.across[k] == Patch::kNone) continue;
      const Patch::Face& other = patch.faces()[face.across[k]];
      bool shared = false;
      for (int j = 0; j < 3; ++j) {
        shared = shared || (other.corners[j] == face.corners[(k + 1) % 3] &&
                            other.corners[(j + 1) % 3] == face.corners[k] && other.across[j] == f);
      }
      EXPECT_TRUE(shared) << "face " << f << " and the one across its edge " << k;
    }
  }
}

TEST(Patch, HoldsTheFacesThatACollapseLeaves) {
  const CertifiedMesh c = plate();
  Change change(*c.mesh);
  ASSERT_TRUE(change.prepare_collapse(edge_into(*c.mesh, kMiddle), c.mesh->vertex_position(kMiddle)));
  for (const int rings : {1, 2, 3}) {
    Patch patch;
    patch.gather(change, rings, true);
    expect_linked(patch);
    EXPECT_EQ(patch.find_vertex(kMiddle - 1), Patch::kNone) << "the vertex that vanishes";
    for (const Coverage::Removed& r : change.removed()) EXPECT_EQ(patch.find_face(r.id), Patch::kNone);
    std::size_t free = 0;
    for (const Patch::Vertex& v : patch.vertices()) {
      free += v.free;
      if (!v.free) continue;
      std::set<std::uint32_t> around;  // those that the mesh has around the vertex, but for the removed ones
      for (const auto f : c.mesh->connectivity().vf_range(BoundedMesh::handle(v.id))) {
        around.insert(static_cast<std::uint32_t>(f.idx()));
      }
      for (const Coverage::Removed& r : change.removed()) around.erase(r.id);
      for (const std::uint32_t f : around) EXPECT_NE(patch.find_face(f), Patch::kNone);
    }
    // In a grid an edge has 8 vertices around it, and 22 within two edges.
    EXPECT_EQ(free, rings == 1 ? 1u : rings == 2 ? 9u : 23u);
  }
}

TEST(Patch, FlipsAsTheMeshDoes) {
  CertifiedMesh c = plate();
  Change change(*c.mesh);
  ASSERT_TRUE(change.prepare_collapse(edge_into(*c.mesh, kMiddle), c.mesh->vertex_position(kMiddle)));
  Patch patch;
  patch.gather(change, 3, true);
  patches::flip_all(patch, patches::faces_of(patch));
  EXPECT_GT(patch.flips().size(), 20u);
  expect_linked(patch);
  ASSERT_TRUE(patches::carry_out(*c.mesh, change, patch)) << "the mesh allows what the patch allows";
  for (const Patch::Face& face : patch.faces()) {
    const glm::uvec3& t = c.mesh->triangle(face.id);
    EXPECT_EQ(corners_of(patch, face), turned(t.x, t.y, t.z));
  }
}

TEST(Patch, IsNotTakenAroundAVertexWithManyFaces) {
  for (const unsigned sides : {100u, 150u, 700u, unsigned(many(20000))}) {
    TriangleMesh mesh = shapes::fan(sides);  // flat but for the waves of its rim
    for (unsigned i = 0; i < sides; ++i) mesh.vertices[i + 1].z = 0.1 * (i % 2);
    const CertifiedMesh c(mesh, mesh.vertices, 0.3);
    Change change(*c.mesh);
    const auto h = c.mesh->connectivity().find_halfedge(BoundedMesh::handle(1), BoundedMesh::handle(2));
    ASSERT_TRUE(change.prepare_collapse(h, c.mesh->vertex_position(2)));
    Patch patch;
    EXPECT_TRUE(patch.gather(change, 1, true)) << "a collapse on the rim has few faces";
    EXPECT_EQ(patch.gather(change, 2, true), sides <= 150) << sides << " sides around the apex";
    EXPECT_EQ(patch.gather(change, 3, true), sides <= 150);
  }
}

TEST(Patch, KeepsEdgesThatHaveToStay) {
  std::vector<bool> pinned((kSide + 1) * (kSide + 1), false);
  pinned[kMiddle + 2] = pinned[kMiddle + 3] = true;
  const CertifiedMesh c = plate(pinned);
  Change change(*c.mesh);
  ASSERT_TRUE(change.prepare_collapse(edge_into(*c.mesh, kMiddle), c.mesh->vertex_position(kMiddle)));
  Patch patch;
  patch.gather(change, 4, false);
  std::size_t between_pinned = 0;
  for (std::uint32_t f = 0; f < patch.faces().size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Patch::Vertex &a = patch.vertices()[patch.faces()[f].corners[k]],
                          &b = patch.vertices()[patch.faces()[f].corners[(k + 1) % 3]];
      Patch::Flipped flipped;
      const bool must_stay = a.pinned && b.pinned;
      between_pinned += must_stay;
      if (must_stay || patch.faces()[f].across[k] == Patch::kNone) {
        EXPECT_FALSE(patch.can_flip(f, k, flipped));
      }
      if (patch.faces()[f].boundary[k]) {
        EXPECT_TRUE(c.mesh->on_boundary(a.id) && c.mesh->on_boundary(b.id));
      }
    }
  }
  EXPECT_EQ(between_pinned, 2u) << "one edge, from both sides";
  for (const Patch::Vertex& v : patch.vertices()) {
    EXPECT_EQ(v.pinned, pinned[v.id]);
    EXPECT_FALSE(v.free && (v.pinned || c.mesh->on_boundary(v.id)));
  }
}

TEST(Patch, MakesNoEdgeThatTheMeshHasOutside) {
  // A tube of three sides: a flip in one ring would make an edge that the tube already has beyond the patch.
  TriangleMesh tube;
  constexpr unsigned kRings = 9;
  for (unsigned i = 0; i < kRings; ++i) {
    for (unsigned k = 0; k < 3; ++k) {
      tube.vertices.emplace_back(std::cos(2.1 * k), std::sin(2.1 * k), 0.5 * i);
      if (i + 1 == kRings) continue;
      const unsigned a = 3 * i + k, b = 3 * i + (k + 1) % 3;
      if (k == 0) {  // The edges along the tube at the first vertex of a ring have the ring's other two beside them.
        tube.triangles.emplace_back(a, b, a + 3), tube.triangles.emplace_back(b, b + 3, a + 3);
      } else {
        tube.triangles.emplace_back(a, b, b + 3), tube.triangles.emplace_back(a, b + 3, a + 3);
      }
    }
  }
  const CertifiedMesh c(tube, tube.vertices, 0.3);
  Change change(*c.mesh);
  std::size_t refused = 0;
  for (std::uint32_t e = 0; e < c.mesh->connectivity().n_edges(); ++e) {
    const auto h = c.mesh->connectivity().halfedge_handle(BoundedMesh::edge(e), 0);
    if (!change.prepare_collapse(h, c.mesh->vertex_position(c.mesh->to(h)))) continue;
    Patch patch;
    patch.gather(change, 1, true);
    for (std::uint32_t f = 0; f < patch.faces().size(); ++f) {
      for (int k = 0; k < 3; ++k) {
        if (patch.faces()[f].across[k] == Patch::kNone) continue;
        const Patch::Face &first = patch.faces()[f], &second = patch.faces()[first.across[k]];
        int j = 0;
        while (second.corners[j] != first.corners[(k + 1) % 3]) ++j;
        const std::uint32_t apex = patch.vertices()[first.corners[(k + 2) % 3]].id,
                            other = patch.vertices()[second.corners[(j + 2) % 3]].id;
        const bool there =
            c.mesh->connectivity().find_halfedge(BoundedMesh::handle(apex), BoundedMesh::handle(other)).is_valid();
        Patch::Flipped flipped;
        if (!there) continue;
        ++refused;
        EXPECT_FALSE(patch.can_flip(f, k, flipped));
      }
    }
  }
  EXPECT_GT(refused, 0u);
}

}  // namespace
