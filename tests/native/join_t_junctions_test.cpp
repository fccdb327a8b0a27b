// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/join_t_junctions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "decimation_cases.h"
#include "geometry/frame.h"
#include "geometry/weld.h"
#include "shapes.h"
#include "topology/crossings.h"
#include "topology/divide_triangle.h"
#include "topology/manifold_cut.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kFloat = 0x1p-24;

/// The T-junctions of a mesh, by its own vertices.
std::vector<TJunction> junctions_of(const TriangleMesh& mesh) {
  Team alone(1);
  const CutMesh cut = cut_to_manifold(mesh.vertices, mesh.triangles, alone);
  TriangleMesh as_cut{{}, cut.triangles};
  for (const std::uint32_t v : cut.vertex_input) as_cut.vertices.push_back(mesh.vertices[v]);
  std::vector<TJunction> result = find_t_junctions(as_cut, cut.boundary, kFloat, alone).vertices;
  for (TJunction& j : result) {
    j.vertex = cut.vertex_input[j.vertex];
    for (int k = 0; k < 3; ++k) j.on[k] = cut.vertex_input[j.on[k]];
  }
  return result;
}

std::optional<JoinedMesh> joined(const TriangleMesh& mesh) {
  Team alone(1);
  return join_t_junctions(mesh.vertices, mesh.triangles, junctions_of(mesh), kFloat, alone);
}

/// The number of edges that one triangle has, by the positions of their ends.
std::size_t open_edges(const TriangleMesh& mesh) {
  std::map<std::set<std::uint32_t>, std::size_t> count;
  const std::vector<std::uint32_t> place = weld_equal_positions(mesh.vertices);
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++count[{place[t[k]], place[t[(k + 1) % 3]]}];
  }
  return static_cast<std::size_t>(std::ranges::count_if(count, [](const auto& e) { return e.second == 1; }));
}

double area(const TriangleMesh& mesh, const glm::uvec3& t) {
  return glm::length(glm::cross(mesh.vertices[t.y] - mesh.vertices[t.x], mesh.vertices[t.z] - mesh.vertices[t.x])) / 2;
}

/// Pieces of a triangle fill it, and look to its side.
void expect_pieces_fill(const TriangleMesh& mesh, const JoinedMesh& joined, double within) {
  std::vector<double> sum(mesh.triangles.size(), 0);
  for (std::uint32_t t = 0; t < joined.triangles.size(); ++t) {
    const auto normal = [&](const glm::uvec3& f) {
      return glm::cross(mesh.vertices[f.y] - mesh.vertices[f.x], mesh.vertices[f.z] - mesh.vertices[f.x]);
    };
    EXPECT_GT(glm::dot(normal(joined.triangles[t]), normal(mesh.triangles[joined.parent[t]])), 0);
    sum[joined.parent[t]] += area(mesh, joined.triangles[t]);
    if (!joined.is_piece[t]) {
      EXPECT_EQ(joined.triangles[t], mesh.triangles[t]);
    }
  }
  for (std::size_t t = 0; t < sum.size(); ++t) {
    EXPECT_NEAR(sum[t], area(mesh, mesh.triangles[t]), within * area(mesh, mesh.triangles[t]));
  }
}

/// A plate of n x n squares beside one of 2 n x 2 n, turned by some angle and moved away from the origin.
TriangleMesh plates(unsigned n, double angle, double scale, double away) {
  TriangleMesh fine = shapes::grid(2 * n);
  for (dvec3& p : fine.vertices) p.x += 1;
  TriangleMesh both = shapes::joined(shapes::grid(n), fine);
  for (dvec3& p : both.vertices) {
    const dvec3 bent(p.x, p.y, 0.05 * std::sin(5 * p.x));
    const dvec3 turned(std::cos(angle) * bent.x - std::sin(angle) * bent.y,
                       std::sin(angle) * bent.x + std::cos(angle) * bent.y, bent.z);
    p = scale * dvec3(turned.x, std::cos(angle) * turned.y - std::sin(angle) * turned.z,
                      std::sin(angle) * turned.y + std::cos(angle) * turned.z) +
        away;
  }
  return shapes::stored(both);
}

TEST(JoinTJunctions, AlongAnEdgeLeaveNoOpenEdgeThere) {
  const unsigned n = 6;
  for (const double angle : {0.0, 0.3, 1.1, 2.5}) {
    for (const double scale : {1e-3, 1.0, 1e3}) {
      const TriangleMesh mesh = plates(n, angle, scale, 10 * scale);
      const std::optional<JoinedMesh> r = joined(mesh);
      ASSERT_TRUE(r);
      EXPECT_EQ(r->count, n);
      EXPECT_EQ(r->triangles.size(), mesh.triangles.size() + n);
      EXPECT_EQ(open_edges(mesh), 4 * n + 8 * n);
      EXPECT_EQ(open_edges({mesh.vertices, r->triangles}), 3 * n + 6 * n);
      expect_pieces_fill(mesh, *r, 1e-4);
    }
  }
}

TEST(JoinTJunctions, OnTheInsideOfATriangleKeepEdgesThatLieOnIt) {
  // One triangle, and a wall of two squares that stands on it.
  const TriangleMesh mesh{
      {{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {1, 1, 0}, {2, 2, 0}, {3, 2, 0}, {1, 1, 1}, {2, 2, 1}, {3, 2, 1}},
      {{0, 1, 2}, {3, 4, 7}, {3, 7, 6}, {4, 5, 8}, {4, 8, 7}}};
  const std::optional<JoinedMesh> r = joined(mesh);
  ASSERT_TRUE(r);
  EXPECT_EQ(r->count, 3u);
  EXPECT_EQ(r->triangles.size(), mesh.triangles.size() + 2 * 3);
  expect_pieces_fill(mesh, *r, 1e-12);
  std::map<std::set<std::uint32_t>, int> uses;
  for (const glm::uvec3& t : r->triangles) {
    for (int k = 0; k < 3; ++k) ++uses[{t[k], t[(k + 1) % 3]}];
  }
  EXPECT_EQ((uses[{3, 4}]), 3) << "of the wall and two pieces";
  EXPECT_EQ((uses[{4, 5}]), 3);
  Team alone(1);
  EXPECT_TRUE(crossings(mesh.vertices, r->triangles, 100, alone, nullptr).pairs.empty());
}

TEST(JoinTJunctions, LeaveWholeWhatAnEdgeRunsOutOf) {
  // The foot of a triangle goes over the diagonal of a square between its ends.
  const TriangleMesh mesh{{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {3, 1, 0}, {1, 2, 0}, {2, 2, 3}},
                          {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}}};
  EXPECT_EQ(junctions_of(mesh).size(), 2u);
  EXPECT_FALSE(joined(mesh));
  TriangleMesh inside = mesh;
  inside.vertices[5] = {2, 1, 0};
  ASSERT_TRUE(joined(inside));
  EXPECT_EQ(joined(inside)->count, 2u);
}

TEST(JoinTJunctions, DivideTrianglesAtTheSamePlacesAlike) {
  // The other triangle there is the other way round and has vertices of its own.
  TriangleMesh mesh{
      {{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {3, 0, 0}, {5, 0, 0}, {3, -1, 1}, {8, 0, 0}, {0, 8, 0}, {0, 0, 0}},
      {{0, 1, 2}, {7, 6, 8}, {4, 3, 5}}};
  const std::optional<JoinedMesh> r = joined(mesh);
  ASSERT_TRUE(r);
  std::map<std::set<std::array<double, 3>>, int> pieces;
  for (std::uint32_t t = 0; t < r->triangles.size(); ++t) {
    if (!r->is_piece[t]) continue;
    std::set<std::array<double, 3>> at;
    for (int k = 0; k < 3; ++k) {
      const dvec3& p = mesh.vertices[r->triangles[t][k]];
      at.insert({p.x, p.y, p.z});
    }
    ++pieces[at];
  }
  EXPECT_EQ(pieces.size(), 3u);
  for (const auto& [at, count] : pieces) EXPECT_EQ(count, 2);
}

TEST(JoinTJunctions, MakeNoPieceThatRoundingCouldTurn) {
  const float low = 3e-7f;  // the height of the triangle: a few times the rounding of its coordinates
  const TriangleMesh mesh{{{1, 0, 0}, {2, 0, 0}, {1.5, low, 0}, {1.25, 0, 0}, {1.25, -1, 0}, {1.75, -1, 0}},
                          {{0, 1, 2}, {3, 4, 5}}};
  EXPECT_FALSE(joined(mesh));
}

TEST(JoinTJunctions, AddNoPairOfFacesThatCross) {
  // Vertex 3 is on the edge but for rounding, and a sliver lies in between.
  const double off = 0x1p-24;
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0}, {0.5, -off, 0}, {0.25, -1, 0}, {0.75, -1, 0}},
                    {{0, 1, 2}, {3, 4, 5}}};
  ASSERT_TRUE(joined(mesh));
  mesh.vertices.insert(mesh.vertices.end(), {{0.25, -off / 4, -1}, {0.25, -off / 4, 1}, {0.26, -off / 4, 1}});
  mesh.triangles.emplace_back(6, 7, 8);
  Team alone(1);
  EXPECT_TRUE(crossings(mesh.vertices, mesh.triangles, 100, alone, nullptr).pairs.empty());
  EXPECT_FALSE(joined(mesh));
}

TEST(JoinTJunctions, GoOnWithoutWhatIsLeftWhole) {
  // Beside the plates that can be joined there is a foot that cannot.
  TriangleMesh mesh = plates(4, 0, 1, 0);
  const TriangleMesh foot{{{3, 0, 0}, {7, 0, 0}, {7, 4, 0}, {3, 4, 0}, {6, 1, 0}, {4, 2, 0}, {5, 2, 3}},
                          {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}}};
  mesh = shapes::joined(mesh, foot);
  const std::optional<JoinedMesh> r = joined(mesh);
  ASSERT_TRUE(r);
  EXPECT_EQ(r->count, 4u);
}

TEST(DivideTriangle, DependsNeitherOnTheFirstCornerNorOnTheSide) {
  TriangleToDivide t{
      {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {3, 0, 0}, {2, 2, 0}, {4, 3, 0}}, {0, 1, 2}, {0, 3, 1, 2}, {{4, 5}}};
  const auto pieces = divide(t, 1e-6);
  ASSERT_TRUE(pieces);
  const auto sets = [](const std::vector<glm::uvec3>& of) {
    std::set<std::set<std::uint32_t>> result;
    for (const glm::uvec3& p : of) result.insert({p.x, p.y, p.z});
    return result;
  };
  EXPECT_EQ(pieces->size(), 6u);
  TriangleToDivide other = t;
  other.corners = {2, 1, 0}, other.border = {2, 1, 3, 0};
  ASSERT_TRUE(divide(other, 1e-6));
  EXPECT_EQ(sets(*divide(other, 1e-6)), sets(*pieces));
  EXPECT_FALSE(divide(t, 3)) << "pieces are lower than that";
  t.edges.emplace_back(3, 2), t.edges.emplace_back(0, 5);
  EXPECT_FALSE(divide(t, 1e-6)) << "edges that cross";
}

TEST(JoinTJunctions, PlatesBecomeOneSheetInADecimation) {
  for (const auto effort : {DecimationOptions::Effort::fast, DecimationOptions::Effort::thorough}) {
    const cases::Case c{plates(across(16), 0.4, 1, 0)};
    DecimationOptions options;
    options.effort = effort;
    const DecimationResult r = cases::run(c, options);
    EXPECT_FALSE(r.locked.contains("T-junction"));
    EXPECT_LT(r.triangles.size(), 40u);
    ASSERT_FALSE(r.repairs.empty());
    EXPECT_EQ(r.repairs.front().kind, "T-junction");
    EXPECT_EQ(r.repairs.front().count, across(16));
    cases::expect_within(c, r, true);
    Team alone(1);
    EXPECT_EQ(cut_to_manifold(r.vertices, r.triangles, alone).boundary.size(), open_edges({r.vertices, r.triangles}));
    EXPECT_TRUE(crossings(r.vertices, r.triangles, 10, alone, nullptr).pairs.empty());
  }
}

TEST(JoinTJunctions, ThreadsDoNotChangeABit) { cases::expect_same_bits(cases::Case{plates(12, 0.4, 1, 0)}, {}); }

TEST(JoinTJunctions, LockedEdgesStayWhole) {
  const TriangleMesh mesh = plates(6, 0, 1, 0);
  const cases::Case c{mesh};
  const std::unique_ptr<bool[]> locked(new bool[mesh.vertices.size()]());
  for (std::size_t v = 0; v < 7 * 7; ++v) locked[v] = true;
  DecimationOptions options;
  options.locked = {locked.get(), mesh.vertices.size()};
  const DecimationResult r = cases::run(c, options);
  for (std::uint32_t t = 0; t < 2 * 6 * 6; ++t) {
    const auto place = std::ranges::find(r.triangle_source, t);
    ASSERT_NE(place, r.triangle_source.end());
    glm::uvec3 triangle = r.triangles[static_cast<std::size_t>(place - r.triangle_source.begin())];
    for (int k = 0; k < 3; ++k) EXPECT_EQ(r.vertices[triangle[k]], mesh.vertices[mesh.triangles[t][k]]);
  }
  EXPECT_GT(r.locked.at("T-junction"), 0u);
}

}  // namespace
