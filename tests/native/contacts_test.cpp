// SPDX-License-Identifier: GPL-3.0-or-later
// The edges and points in which sheets meet, each with vertices of its own: what a decimation may do to them.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "certified_mesh.h"
#include "decimation/change.h"
#include "decimation/refinement/patch.h"
#include "patches.h"

namespace {

using namespace tolvol;

constexpr unsigned kSide = 4;

/// Two boxes that touch along an edge.
CertifiedMesh boxes() {
  TriangleMesh second = shapes::box(kSide);
  for (glm::dvec3& p : second.vertices) p.x += 1, p.y += 1;
  const TriangleMesh both = shapes::joined(shapes::box(kSide), second);
  return {both, both.vertices, 0.3};
}

bool in_line(const BoundedMesh& mesh, std::uint32_t a, std::uint32_t b) {
  const glm::dvec3 &p = mesh.stored(a), &q = mesh.stored(b);
  return p.x == 1 && p.y == 1 && q.x == 1 && q.y == 1;
}

TEST(ContactLine, IsNotFlippedAway) {
  const CertifiedMesh c = boxes();
  Change change(*c.mesh);
  std::size_t line = 0, others = 0;
  for (std::uint32_t e = 0; e < c.mesh->connectivity().n_edges(); ++e) {
    const auto h = c.mesh->connectivity().halfedge_handle(BoundedMesh::edge(e), 0);
    const bool is_possible = change.prepare_flip(BoundedMesh::edge(e));
    if (in_line(*c.mesh, c.mesh->from(h), c.mesh->to(h))) {
      ++line;
      EXPECT_FALSE(is_possible);
    } else {
      others += is_possible;
    }
  }
  EXPECT_EQ(line, 2 * kSide);
  EXPECT_GT(others, 100u);
}

TEST(ContactLine, CollapsesAlongItselfAlone) {
  const CertifiedMesh c = boxes();
  Change change(*c.mesh);
  std::size_t along = 0, off = 0;
  for (std::uint32_t h = 0; h < c.mesh->connectivity().n_halfedges(); ++h) {
    const BoundedMesh::Halfedge halfedge(static_cast<int>(h));
    const std::uint32_t from = c.mesh->from(halfedge), to = c.mesh->to(halfedge);
    if (!in_line(*c.mesh, from, from)) continue;
    const bool is_possible = change.prepare_collapse(halfedge, c.mesh->vertex_position(to));
    if (in_line(*c.mesh, from, to)) {
      along += is_possible;
    } else {
      ++off;
      EXPECT_FALSE(is_possible);
    }
  }
  EXPECT_EQ(along, 4 * kSide) << "each edge of both boxes, in both directions";
  EXPECT_GT(off, 20u);
}

TEST(ContactLine, IsNotFlippedAwayInAPatch) {
  const CertifiedMesh c = boxes();
  Change change(*c.mesh);
  std::size_t seen = 0;
  for (std::uint32_t e = 0; e < c.mesh->connectivity().n_edges(); ++e) {
    const auto h = c.mesh->connectivity().halfedge_handle(BoundedMesh::edge(e), 0);
    if (!change.prepare_collapse(h, c.mesh->vertex_position(c.mesh->to(h)))) continue;
    Patch patch;
    if (!patch.gather(change, 2, true)) continue;
    for (std::uint32_t f = 0; f < patch.faces().size(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const auto id = [&](int corner) { return patch.vertices()[patch.faces()[f].corners[corner]].id; };
        if (patch.faces()[f].across[k] == Patch::kNone || !in_line(*c.mesh, id(k), id((k + 1) % 3))) continue;
        ++seen;
        Patch::Flipped flipped;
        EXPECT_FALSE(patch.can_flip(f, k, flipped));
      }
    }
  }
  EXPECT_GT(seen, 0u);
}

/// A plate with a fold, whose two sides touch in one point.
CertifiedMesh folded() {
  constexpr unsigned n = 8;
  TriangleMesh plate = shapes::grid(n);
  glm::dvec3 &left = plate.vertices[3 * (n + 1) + 4], &middle = plate.vertices[4 * (n + 1) + 4],
             &right = plate.vertices[5 * (n + 1) + 4];
  left = right = middle;
  middle.z += 0.2;
  return {plate, plate.vertices, 0.3};
}

TEST(ContactPoint, AllowsInTheMeshWhatItAllowsInAPatch) {
  std::size_t flips = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    CertifiedMesh c = folded();
    const OpenMesh::TriConnectivity& connectivity = c.mesh->connectivity();
    Change change(*c.mesh);
    Patch patch;
    for (int step = 0; step < 20; ++step) {
      const BoundedMesh::Halfedge h(static_cast<int>(random() % connectivity.n_halfedges()));
      if (connectivity.status(connectivity.edge_handle(h)).deleted()) continue;
      if (!change.prepare_collapse(h, c.mesh->vertex_position(c.mesh->to(h)))) continue;
      if (!patch.gather(change, 2, true)) continue;
      std::vector<std::uint32_t> faces = patches::faces_of(patch);
      std::shuffle(faces.begin(), faces.end(), random);
      patches::flip_all(patch, faces);
      ASSERT_TRUE(patches::carry_out(*c.mesh, change, patch)) << "seed " << seed << ", step " << step;
      flips += patch.flips().size();
    }
  }
  EXPECT_GT(flips, 10000u);
}

}  // namespace
