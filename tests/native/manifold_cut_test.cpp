// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/manifold_cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "shapes.h"

namespace {

using namespace tolvol;

CutMesh cut(const TriangleMesh& mesh) {
  Team team(2);
  return cut_to_manifold(mesh.vertices, mesh.triangles, team);
}

/// An oriented manifold: every directed edge once with its mate, and the triangles around a vertex in one fan.
void expect_manifold(const CutMesh& mesh) {
  std::map<std::pair<unsigned, unsigned>, std::uint32_t> side;
  const auto ends = [&](std::uint32_t s) {
    return std::pair(mesh.triangles[s / 3][s % 3], mesh.triangles[s / 3][(s + 1) % 3]);
  };
  ASSERT_EQ(mesh.mates.size(), 3 * mesh.triangles.size());
  for (std::uint32_t s = 0; s < mesh.mates.size(); ++s) side[ends(s)] = s;
  for (std::uint32_t s = 0; s < mesh.mates.size(); ++s) {
    const auto mate = side.find({ends(s).second, ends(s).first});
    ASSERT_EQ(mesh.mates[s], mate == side.end() ? CutMesh::kNone : mate->second) << "side " << s;
  }
  std::set<std::pair<unsigned, unsigned>> directed;
  std::map<unsigned, std::vector<std::pair<unsigned, unsigned>>> links;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      ASSERT_NE(t[k], t[(k + 1) % 3]);
      ASSERT_TRUE(directed.emplace(t[k], t[(k + 1) % 3]).second);
      links[t[k]].emplace_back(t[(k + 1) % 3], t[(k + 2) % 3]);
    }
  }
  for (auto& [vertex, link] : links) {
    std::map<unsigned, unsigned> next(link.begin(), link.end());
    ASSERT_EQ(next.size(), link.size());
    std::set<unsigned> ends;
    for (const auto& [a, b] : link) ends.insert(b);
    unsigned at = link[0].first;
    for (const auto& [a, b] : link) {
      if (!ends.contains(a)) at = a;  // where an open fan starts
    }
    std::size_t steps = 0;
    for (; next.contains(at) && steps < link.size(); ++steps) at = next[at];
    ASSERT_EQ(steps, link.size()) << "two fans at vertex " << vertex;
  }
}

std::size_t tied(const CutMesh& mesh) {
  return std::size_t(
      std::count_if(mesh.cause.begin(), mesh.cause.end(), [](CutCause c) { return c != CutCause::none; }));
}

TEST(ManifoldCut, LeavesAManifoldAlone) {
  const TriangleMesh mesh = shapes::torus(8);
  const CutMesh result = cut(mesh);
  expect_manifold(result);
  EXPECT_EQ(result.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(result.vertex_input.size(), mesh.vertices.size());
  EXPECT_EQ(tied(result) + result.duplicates + result.welded + result.cut_edges + result.reversed_count, 0u);
  EXPECT_TRUE(result.boundary.empty());
}

TEST(ManifoldCut, WeldsASoup) {
  const TriangleMesh mesh = shapes::torus(8), soup = shapes::soup(mesh);
  const CutMesh result = cut(soup);
  expect_manifold(result);
  EXPECT_EQ(result.vertex_input.size(), mesh.vertices.size());
  EXPECT_EQ(result.welded, soup.vertices.size() - mesh.vertices.size());
  EXPECT_EQ(tied(result), 0u);
}

TEST(ManifoldCut, CutsAFinAndTiesItsEdge) {
  // Three triangles at one edge.
  const TriangleMesh fin{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}};
  const CutMesh result = cut(fin);
  expect_manifold(result);
  EXPECT_EQ(result.triangles.size(), 3u);
  EXPECT_EQ(result.cut_edges, 1u);
  std::set<unsigned> slots;
  for (std::size_t v = 0; v < result.cause.size(); ++v) {
    const bool at_edge = result.vertex_input[v] < 2;
    EXPECT_EQ(result.cause[v] != CutCause::none, at_edge);
    if (at_edge) slots.insert(result.output_slot[v]);
  }
  EXPECT_EQ(slots.size(), 2u) << "both ends are one vertex each in the result";
}

TEST(ManifoldCut, SplitsTwoFansAtAVertex) {
  const TriangleMesh bow{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 3, 4}}};
  const CutMesh result = cut(bow);
  expect_manifold(result);
  EXPECT_EQ(tied(result), 2u);
}

TEST(ManifoldCut, TiesTouchingSheetsWithoutJoiningThem) {
  // Two boxes that touch in one corner, each with a vertex of its own there.
  TriangleMesh second = shapes::box(2);
  for (glm::dvec3& p : second.vertices) p += 1.0;
  const TriangleMesh mesh = shapes::joined(shapes::box(2), second);
  const CutMesh result = cut(mesh);
  expect_manifold(result);
  EXPECT_EQ(result.cut_edges, 0u);
  EXPECT_EQ(tied(result), 2u);
  EXPECT_EQ(result.vertex_input.size(), mesh.vertices.size());
  std::size_t second_copies = 0;
  for (std::uint32_t v = 0; v < result.vertex_input.size(); ++v) {
    second_copies += result.copies_of[v] != v;
    EXPECT_EQ(result.output_slot[v], v) << "vertices of their own in the result";
    const std::uint32_t copy = result.copies_of[v];
    EXPECT_EQ(mesh.vertices[result.vertex_input[v]], mesh.vertices[result.vertex_input[copy]]);
  }
  EXPECT_EQ(second_copies, 1u);
}

TEST(ManifoldCut, TiesSheetsThatLieOnEachOtherWhereTheyPart) {
  // Two boxes that share the positions of one face, but no vertex. The middle of that face is one more place of both.
  TriangleMesh second = shapes::box(2);
  for (glm::dvec3& p : second.vertices) p.x += 1;
  const TriangleMesh mesh = shapes::joined(shapes::box(2), second);
  const CutMesh result = cut(mesh);
  expect_manifold(result);
  EXPECT_EQ(result.cut_edges, 0u);
  EXPECT_EQ(tied(result), 2 * 8u);
  EXPECT_EQ(result.vertex_input.size(), mesh.vertices.size());
}

TEST(ManifoldCut, DropsExactDuplicatesOnly) {
  TriangleMesh mesh = shapes::grid(2);
  const glm::uvec3 a = mesh.triangles[3], b = mesh.triangles[0];
  mesh.triangles.push_back({a.y, a.z, a.x});  // the same, rotated
  mesh.triangles.push_back({b.x, b.z, b.y});  // the same vertices, turned over
  const unsigned n = unsigned(mesh.vertices.size());
  for (int k = 0; k < 3; ++k) mesh.vertices.push_back(mesh.vertices[mesh.triangles[5][k]]);
  mesh.triangles.push_back({n, n + 2, n + 1});  // the other side of one, on vertices of its own: stays
  mesh.triangles.push_back({n, n + 1, n + 2});  // this side of it, on vertices of its own
  const CutMesh result = cut(mesh);
  expect_manifold(result);
  EXPECT_EQ(result.duplicates, 3u);
  EXPECT_EQ(result.stand_in[8], 3u);
  EXPECT_EQ(result.stand_in[9], 0u);
  EXPECT_EQ(result.stand_in[11], 5u);
  EXPECT_EQ(result.triangles.size(), 9u);
}

TEST(ManifoldCut, Degenerates) {
  TriangleMesh mesh = shapes::grid(2);
  mesh.triangles.push_back({0, 1, 1});  // on an edge of the grid
  mesh.triangles.push_back({0, 0, 0});  // on a vertex
  mesh.vertices.push_back({5, 5, 5});
  mesh.triangles.push_back({8, 9, 9});  // a segment that nothing else holds
  const CutMesh result = cut(mesh);
  expect_manifold(result);
  EXPECT_EQ(result.degenerate_on_edge, 2u);
  EXPECT_EQ(result.aside, std::vector<std::uint32_t>{10});
  EXPECT_NE(result.cause[result.input_vertex[8]], CutCause::none) << "must stay where the segment ends";
  EXPECT_NE(result.input_vertex[9], CutMesh::kNone);
}

TEST(ManifoldCut, OrientsConsistently) {
  TriangleMesh mesh = shapes::torus(8);
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 5) std::swap(mesh.triangles[i].y, mesh.triangles[i].z);
  const CutMesh result = cut(mesh);
  expect_manifold(result);
  EXPECT_EQ(tied(result), 0u);
  EXPECT_EQ(result.reversed_count, (mesh.triangles.size() + 4) / 5);
  for (std::size_t t = 0; t < result.triangles.size(); ++t) {
    glm::uvec3 c = result.triangles[t];
    if (result.reversed[t]) std::swap(c.y, c.z);
    const glm::uvec3 in = mesh.triangles[result.triangle_input[t]];
    EXPECT_EQ(glm::uvec3(result.vertex_input[c.x], result.vertex_input[c.y], result.vertex_input[c.z]), in);
  }
}

TEST(ManifoldCut, CutsAMoebiusStripSomewhere) {
  TriangleMesh mesh;
  const unsigned n = 12;
  for (unsigned i = 0; i < n; ++i) {
    const double u = 2 * std::numbers::pi * i / n, w = 0.3;
    for (const double s : {-w, w}) {
      const double r = 1 + s * std::cos(u / 2);
      mesh.vertices.emplace_back(r * std::cos(u), r * std::sin(u), s * std::sin(u / 2));
    }
  }
  for (unsigned i = 0; i < n; ++i) {
    const unsigned a = 2 * i, b = 2 * i + 1, c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? b + 2 : 0;
    mesh.triangles.emplace_back(a, c, b), mesh.triangles.emplace_back(b, c, d);
  }
  const CutMesh result = cut(mesh);
  expect_manifold(result);
  EXPECT_GE(result.cut_edges, 1u);
  EXPECT_EQ(result.triangles.size(), mesh.triangles.size());
}

TEST(ManifoldCut, AnySoupBecomesAManifold) {
  // Random triangles over few vertices: everything that can go wrong does.
  for (unsigned seed = 0; seed < 300; ++seed) {
    std::mt19937 engine(seed);
    TriangleMesh mesh;
    const unsigned vertices = 4 + engine() % 8, triangles = 1 + engine() % 40;
    for (unsigned i = 0; i < vertices; ++i) mesh.vertices.emplace_back(engine() % 3, engine() % 3, engine() % 2);
    for (unsigned i = 0; i < triangles; ++i)
      mesh.triangles.emplace_back(engine() % vertices, engine() % vertices, engine() % vertices);
    const CutMesh result = cut(mesh);
    expect_manifold(result);
    for (const unsigned threads : {1u, 3u, 16u}) {
      Team team(threads);
      const CutMesh other = cut_to_manifold(mesh.vertices, mesh.triangles, team);
      EXPECT_EQ(other.triangles, result.triangles);
      EXPECT_EQ(other.mates, result.mates);
      EXPECT_EQ(other.triangle_input, result.triangle_input);
      EXPECT_EQ(other.reversed, result.reversed);
      EXPECT_EQ(other.vertex_input, result.vertex_input);
      EXPECT_EQ(other.cause, result.cause);
      EXPECT_EQ(other.boundary, result.boundary);
      EXPECT_EQ(other.output_slot, result.output_slot);
      EXPECT_EQ(other.copies_of, result.copies_of);
      EXPECT_EQ(other.input_vertex, result.input_vertex);
      EXPECT_EQ(other.stand_in, result.stand_in);
      EXPECT_EQ(other.cut_edges, result.cut_edges);
    }
    EXPECT_EQ(result.triangles.size() + result.duplicates + result.degenerate_on_edge + result.aside.size(), triangles);
    for (const glm::uvec3& t : mesh.triangles) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t v = result.input_vertex[t[k]];
        ASSERT_NE(v, CutMesh::kNone);
        EXPECT_EQ(mesh.vertices[result.vertex_input[v]], mesh.vertices[t[k]]);
      }
    }
  }
}

}  // namespace
