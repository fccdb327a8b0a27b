// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/boundary_loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "geometry/weld.h"
#include "many.h"
#include "shapes.h"
#include "topology/sides.h"
#include "without.h"

namespace {

using namespace tolvol;
using glm::dvec3;

std::vector<BoundaryLoop> of(const TriangleMesh& mesh, unsigned threads = 1) {
  Team team(threads);
  return boundary_loops(mesh.vertices, weld_equal_positions(mesh.vertices), mesh.triangles, team);
}

std::uint32_t vertex_of(const TriangleMesh& mesh, Side corner) {
  return mesh.triangles[corner / 3][static_cast<int>(corner % 3)];
}

std::vector<std::size_t> lengths(const std::vector<BoundaryLoop>& loops) {
  std::vector<std::size_t> found;
  for (const BoundaryLoop& loop : loops) found.push_back(loop.closed ? loop.sides.size() : 0);
  std::sort(found.begin(), found.end());
  return found;
}

using Lengths = std::vector<std::size_t>;

TEST(BoundaryLoops, AClosedSurfaceHasNoneAndEveryHoleOne) {
  EXPECT_TRUE(of(shapes::torus(12)).empty());
  EXPECT_TRUE(of(shapes::soup(shapes::torus(12))).empty());
  EXPECT_EQ(lengths(of(shapes::grid(5))), Lengths{20});
  EXPECT_EQ(lengths(of(without(shapes::torus(12), [](unsigned t) { return t == 3 || t == 120 || t == 121; }))),
            (Lengths{3, 4}));
}

TEST(BoundaryLoops, EdgesFollowOnEachOtherInTheDirectionOfTheirTriangles) {
  const TriangleMesh mesh = without(shapes::torus(12), [](unsigned t) { return t % 7 == 0; });
  std::set<Side> all;
  Side last_first = 0;
  const std::vector<std::uint32_t> place = weld_equal_positions(mesh.vertices);
  for (const BoundaryLoop& loop : of(mesh)) {
    ASSERT_TRUE(loop.closed);
    EXPECT_EQ(loop.sides.front(), *std::min_element(loop.sides.begin(), loop.sides.end()));
    EXPECT_TRUE(all.empty() || loop.sides.front() > last_first);
    last_first = loop.sides.front();
    for (std::size_t i = 0; i < loop.sides.size(); ++i) {
      EXPECT_TRUE(all.insert(loop.sides[i]).second);
      EXPECT_EQ(place[vertex_of(mesh, next_corner(loop.sides[i]))],
                place[vertex_of(mesh, loop.sides[(i + 1) % loop.sides.size()])]);
    }
  }
  EXPECT_GT(all.size(), 50u);
}

/// Squares of the grid: 2 (i n + j) and the next number.
TEST(BoundaryLoops, HolesThatTouchInAVertexAreTwoLoops) {
  const unsigned n = 6;
  const auto square = [n](unsigned i, unsigned j) { return i * n + j; };
  const TriangleMesh mesh = without(shapes::grid(n), [&](unsigned t) {
    return t / 2 == square(1, 1) || t / 2 == square(2, 2) || t / 2 == square(3, 1) || t / 2 == square(4, 4);
  });
  EXPECT_EQ(lengths(of(mesh)), (Lengths{4, 4, 4, 4, 24}));
  EXPECT_EQ(lengths(of(shapes::turned(mesh))), (Lengths{4, 4, 4, 4, 24}));
}

TEST(BoundaryLoops, AnIslandThatTouchesTheRimBelongsToItsLoop) {
  const unsigned n = 6;
  // A ring of squares around the square (2, 2) is gone, but for the one at its corner.
  const TriangleMesh mesh = without(shapes::grid(n), [&](unsigned t) {
    const unsigned i = t / 2 / n, j = t / 2 % n;
    return i >= 1 && i <= 3 && j >= 1 && j <= 3 && !(i == 2 && j == 2) && !(i == 1 && j == 1);
  });
  // The hole is a disc whose border passes the corner of the island that the remaining square touches twice.
  EXPECT_EQ(lengths(of(mesh)), (Lengths{16, 24}));
}

TEST(BoundaryLoops, HolesTouchInVerticesOfACrookedSurfaceToo) {
  // Every triangle is missing whose neighbours are all there: each is a loop of three.
  shapes::Random random(3);
  TriangleMesh mesh = shapes::sphere(16);
  for (dvec3& p : mesh.vertices) p *= 1 + 0.02 * random.point().x;
  std::set<std::pair<unsigned, unsigned>> rims;
  std::size_t holes = 0;
  mesh = without(mesh, [&](unsigned t) {
    const glm::uvec3 c = mesh.triangles[t];
    for (int k = 0; k < 3; ++k) {
      if (rims.contains(std::minmax(c[k], c[(k + 1) % 3]))) return false;
    }
    if (random.share() < 0.4) return false;
    for (int k = 0; k < 3; ++k) rims.insert(std::minmax(c[k], c[(k + 1) % 3]));
    ++holes;
    return true;
  });
  EXPECT_EQ(lengths(of(mesh)), Lengths(holes, 3));
  EXPECT_GT(holes, 300u);
}

TEST(BoundaryLoops, SeamsBetweenVerticesAtOnePlaceAreNoHoles) {
  TriangleMesh mesh = shapes::soup(without(shapes::torus(12), [](unsigned t) { return t == 5; }));
  EXPECT_EQ(lengths(of(mesh)), Lengths{3});
}

TEST(BoundaryLoops, RimsAgainstEachOtherAreNoLoop) {
  TriangleMesh mesh = without(shapes::torus(12), [](unsigned t) { return t == 5 || t == 100; });
  // One triangle at the rim of the first hole is turned over.
  const std::vector<BoundaryLoop> before = of(mesh);
  ASSERT_EQ(lengths(before), (Lengths{3, 3}));
  glm::uvec3& turned = mesh.triangles[before[0].sides[1] / 3];
  std::swap(turned.y, turned.z);
  std::size_t open = 0, closed = 0;
  for (const BoundaryLoop& loop : of(mesh)) (loop.closed ? closed : open) += loop.sides.size();
  EXPECT_EQ(open, 3u);
  EXPECT_EQ(closed, 3u);
}

TEST(BoundaryLoops, AFinOnAnEdgeOfTwoTrianglesIsNoLoop) {
  TriangleMesh mesh = shapes::grid(4);
  mesh.vertices.emplace_back(0.5, 0.5, 1);
  mesh.triangles.emplace_back(12, 13, 25);  // a third triangle at the edge (12, 13)
  const std::vector<BoundaryLoop> loops = of(mesh);
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_TRUE(loops[0].closed);
  EXPECT_FALSE(loops[1].closed);
  EXPECT_EQ(loops[1].sides.size(), 2u);
}

TEST(BoundaryLoops, DuplicatesAndTrianglesOnTwoPlacesDoNotCount) {
  TriangleMesh mesh = without(shapes::grid(5), [](unsigned t) { return t == 24; });
  const Lengths expected = lengths(of(mesh));
  EXPECT_EQ(expected, (Lengths{3, 20}));
  const glm::uvec3 rim = mesh.triangles[23];
  mesh.triangles.emplace_back(rim.z, rim.x, rim.y);
  mesh.triangles.emplace_back(rim.x, rim.x, rim.y);
  EXPECT_EQ(lengths(of(mesh)), expected);
}

TEST(BoundaryLoops, ManyThreadsGiveTheSame) {
  shapes::Random random(5);
  for (int round = 0; round < many(5); ++round) {
    const TriangleMesh mesh = without(shapes::torus(60, 0.05), [&](unsigned) { return random.share() < 0.3; });
    const std::vector<BoundaryLoop> one = of(mesh, 1), four = of(mesh, 4);
    ASSERT_EQ(one.size(), four.size());
    for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].sides, four[i].sides);
    EXPECT_TRUE(std::all_of(one.begin(), one.end(), [](const BoundaryLoop& loop) { return loop.closed; }));
  }
}

}  // namespace
