// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>

#include "crossing_judge.h"
#include "many.h"
#include "shapes.h"
#include "topology/faces_cross.h"

namespace {

using tolvol::crossings;
using tolvol::Team;
using tolvol::TriangleMesh;
using Pairs = tolvol::CrossingPairs;
constexpr std::size_t kAll = 1u << 30;

Pairs found(const TriangleMesh& mesh, unsigned threads = 2, std::size_t most = kAll) {
  Team team(threads);
  Pairs pairs;
  for (const glm::uvec2& pair : crossings(mesh.vertices, mesh.triangles, most, team, nullptr).pairs) {
    pairs.emplace_back(pair.x, pair.y);
  }
  return pairs;
}

// On a coarse lattice many corners and edges are shared, and many triangles lie in one plane.
TEST(Crossings, AreThoseWhoseIntersectionIsMoreThanACornerOrAnEdge) {
  std::size_t total = 0;
  for (unsigned seed = 0; seed < unsigned(tolvol::many(24)); ++seed) {
    tolvol::shapes::Random random(seed);
    TriangleMesh mesh;
    const unsigned steps = 2 + seed % 6;
    while (mesh.triangles.size() < 40) {
      tolvol::Corners corners;
      for (glm::dvec3& p : corners) {
        p = glm::dvec3(random.below(steps), random.below(steps), random.below(seed % 3 == 0 ? 1 : steps));
        if (seed % 2) p += 0.1 * random.point() * double(random.below(2));
      }
      if (tolvol::is_degenerate(corners)) continue;  // the judge asks for triangles with an area
      const auto n = static_cast<unsigned>(mesh.vertices.size());
      mesh.vertices.insert(mesh.vertices.end(), corners.begin(), corners.end());
      mesh.triangles.emplace_back(n, n + 1, n + 2);
    }
    const Pairs pairs = found(mesh);
    Pairs expected;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto corners = [&](std::uint32_t t) {
        return tolvol::Corners{mesh.vertices[3 * t], mesh.vertices[3 * t + 1], mesh.vertices[3 * t + 2]};
      };
      for (std::uint32_t j = i + 1; j < mesh.triangles.size(); ++j) {
        if (tolvol::cross_by_cgal(corners(i), corners(j))) expected.emplace_back(i, j);
      }
    }
    EXPECT_EQ(pairs, expected) << seed;
    total += pairs.size();
  }
  EXPECT_GT(total, std::size_t(tolvol::many(1000)));
}

TEST(Crossings, OfAClosedSurfaceAreNone) {
  EXPECT_TRUE(found(tolvol::shapes::sphere(12)).empty());
  EXPECT_TRUE(found(tolvol::shapes::box(9)).empty());
  EXPECT_TRUE(found(tolvol::shapes::torus(24, 0.002)).empty());
}

TEST(Crossings, AreTheSameOnAnyNumberOfThreads) {
  TriangleMesh rough = tolvol::shapes::torus(40);
  tolvol::shapes::Random random(1);
  for (glm::dvec3& p : rough.vertices) p += 0.05 * random.point();
  const Pairs pairs = found(rough, 1);
  EXPECT_GT(pairs.size(), 10u);
  EXPECT_EQ(pairs, found(rough, 2));
  EXPECT_EQ(pairs, found(rough, 4));
  EXPECT_EQ(pairs, tolvol::crossings_by_cgal(rough));
}

// Faces at a corner of very many are searched in another way, and pairs of them with others are found once.
TEST(Crossings, OfFacesAroundACornerOfVeryManyAreFoundOnce) {
  TriangleMesh mesh = tolvol::shapes::torus(24);
  tolvol::shapes::Random random(3);
  for (int fan = 0; fan < 2; ++fan) {
    const auto hub = static_cast<unsigned>(mesh.vertices.size());
    mesh.vertices.push_back(random.point());
    for (unsigned i = 0; i < 300; ++i) {
      mesh.vertices.push_back(1.5 * random.point());
      if (i) mesh.triangles.emplace_back(hub, hub + i, hub + i + 1);
    }
  }
  const Pairs pairs = found(mesh);
  EXPECT_GT(pairs.size(), 1000u);
  EXPECT_EQ(pairs, tolvol::crossings_by_cgal(mesh));
  EXPECT_EQ(pairs, found(mesh, 1));
}

TEST(Crossings, EndAtTheMostThatWereAskedFor) {
  TriangleMesh fan;
  for (unsigned i = 0; i < 300; ++i) {
    fan.vertices.insert(fan.vertices.end(), {glm::dvec3(-1, 0, i), glm::dvec3(1, 0, i), glm::dvec3(0, 1, -double(i))});
    fan.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  Team team(2);
  const tolvol::Crossings all = crossings(fan.vertices, fan.triangles, kAll, team, nullptr);
  EXPECT_TRUE(all.complete);
  const tolvol::Crossings some = crossings(fan.vertices, fan.triangles, 100, team, nullptr);
  EXPECT_FALSE(some.complete);
  EXPECT_EQ(some.pairs.size(), 100u);
  const auto before = [](const glm::uvec2& a, const glm::uvec2& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; };
  EXPECT_TRUE(std::ranges::includes(all.pairs, some.pairs, before));
  EXPECT_EQ(found(fan, 1, 100), found(fan, 3, 100));
  const tolvol::Crossings exact = crossings(fan.vertices, fan.triangles, all.pairs.size(), team, nullptr);
  EXPECT_TRUE(exact.complete);
}

}  // namespace
