// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/display_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "geometry/hierarchy.h"
#include "many.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

TEST(DisplayTree, DistancesAreThoseOfTheHierarchy) {
  for (const TriangleMesh& reference : {shapes::sphere(9), shapes::grid(1), shapes::grid(7), shapes::box(1)}) {
    const DisplayTree tree(reference, false);
    const Hierarchy hierarchy(reference);
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> uniform(-1.2, 1.2);
    for (int i = 0; i < 2000; ++i) {
      const dvec3 p(uniform(engine), uniform(engine), uniform(engine));
      const double truth = hierarchy.nearest(p).distance;
      EXPECT_NEAR(std::abs(tree.distance(p, 10)), truth, DisplayTree::kRounding);
      EXPECT_NEAR(std::abs(tree.distance(p, 0.3)), std::min(truth, 0.3), DisplayTree::kRounding) << "no farther";
    }
  }
}

TEST(DisplayTree, OnTheReferenceItIsNothing) {
  const TriangleMesh reference = shapes::sphere(20);
  const DisplayTree tree(reference, false);
  std::mt19937 engine(6);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const glm::uvec3& t : reference.triangles) {
    const double u = uniform(engine), v = uniform(engine) * (1 - u);
    const dvec3 p = u * reference.vertices[t.x] + v * reference.vertices[t.y] + (1 - u - v) * reference.vertices[t.z];
    EXPECT_LT(std::abs(tree.distance(p, 1)), DisplayTree::kRounding);
  }
}

TEST(DisplayTree, NodesHoldTheirHalvesAndLeavesAllTriangles) {
  const TriangleMesh reference = shapes::sphere(9);
  const DisplayTree tree(reference, false);
  const std::size_t leaves = tree.nodes.size() / 2;
  EXPECT_EQ(tree.corners.size(), 3 * reference.triangles.size());
  EXPECT_EQ(tree.nodes[1].begin, 0);
  EXPECT_EQ(tree.nodes[1].end, static_cast<float>(reference.triangles.size()));
  for (std::size_t i = 1; i < leaves; ++i) {
    EXPECT_EQ(tree.nodes[2 * i].begin, tree.nodes[i].begin);
    EXPECT_EQ(tree.nodes[2 * i].end, tree.nodes[2 * i + 1].begin);
    EXPECT_EQ(tree.nodes[2 * i + 1].end, tree.nodes[i].end);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(tree.nodes[i].lower[k], std::min(tree.nodes[2 * i].lower[k], tree.nodes[2 * i + 1].lower[k]));
      EXPECT_EQ(tree.nodes[i].upper[k], std::max(tree.nodes[2 * i].upper[k], tree.nodes[2 * i + 1].upper[k]));
    }
  }
  for (std::size_t i = leaves; i < 2 * leaves; ++i) EXPECT_LE(tree.nodes[i].end - tree.nodes[i].begin, 4);
}

TEST(DisplayTree, InsideOfAClosedReferenceIsWhatItEnclosesHoweverItsFacesRun) {
  for (const bool mirrored : {false, true}) {
    for (const TriangleMesh& reference : {shapes::sphere(12), shapes::turned(shapes::sphere(12))}) {
      const DisplayTree tree(reference, mirrored);
      EXPECT_TRUE(tree.closed);
      for (const double radius : {0.93, 1.05}) {
        EXPECT_EQ(tree.distance(radius * glm::normalize(dvec3(1, 0.3, 0.2)), 1) < 0, radius < 1) << mirrored;
      }
    }
  }
}

TEST(DisplayTree, OfAnOpenReferenceTheFrontIsOutsideUnlessMirrored) {
  for (const bool mirrored : {false, true}) {
    const DisplayTree tree(shapes::grid(4), mirrored);
    EXPECT_FALSE(tree.closed);
    EXPECT_EQ(tree.distance({0.4, 0.4, 0.05}, 1) > 0, !mirrored);
  }
}

TEST(DisplayTree, IsCancelled) {
  Progress progress;
  progress.cancel();
  EXPECT_THROW(DisplayTree(shapes::sphere(40), false, &progress), Cancelled);
}

TEST(AreaShares, OfASlantedSquareAreThoseOfItsHeights) {
  const DisplayTree tree(shapes::grid(4), false);
  // From 0.02 below the reference to 0.06 above it, a quarter below.
  TriangleMesh slanted = shapes::grid(7);
  for (dvec3& p : slanted.vertices) p = {p.x, p.y, 0.08 * p.x - 0.02};
  const std::vector<double> edges{-0.05, 0, 0.02, 0.1};
  for (const unsigned threads : {1u, 3u}) {
    const std::vector<double> shares = area_shares(tree, slanted.vertices, slanted.triangles, edges, threads);
    ASSERT_EQ(shares.size(), 5u);
    EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1, 1e-9);
    EXPECT_EQ(shares[0], 0);
    EXPECT_NEAR(shares[1], 0.25, 0.003);
    EXPECT_NEAR(shares[2], 0.25, 0.003);
    EXPECT_NEAR(shares[3], 0.5, 0.003);
    EXPECT_EQ(shares[4], 0);
  }
}

TEST(AreaShares, OfTheReferenceItselfNothingIsOutside) {
  const TriangleMesh reference = shapes::sphere(20);
  const std::vector<double> edges{-1e-5, -5e-6, 0, 5e-6, 1e-5};
  const std::vector<double> shares =
      area_shares(DisplayTree(reference, false), reference.vertices, reference.triangles, edges, 2);
  EXPECT_EQ(shares.front(), 0);
  EXPECT_EQ(shares.back(), 0);
}

// Two fans of needles between two lines, each from the far end of the other line. The boxes of half of the needles meet
// in any place, and 85,000 searches would visit a thousand million nodes.
TEST(AreaShares, OfAslantNeedlesAreEstimatedByFewerSamples) {
  constexpr std::uint32_t kNeedles = many(10000);
  TriangleMesh strip;
  for (const double y : {0.0, 0.001}) {
    for (std::uint32_t i = 0; i <= kNeedles; ++i) strip.vertices.emplace_back(static_cast<double>(i) / kNeedles, y, 0);
  }
  constexpr std::uint32_t kUpper = kNeedles + 1, kLast = 2 * kNeedles + 1;
  for (std::uint32_t i = 0; i < kNeedles; ++i) {
    strip.triangles.emplace_back(i, i + 1, kLast);
    strip.triangles.emplace_back(kUpper + i, 0, kUpper + i + 1);
  }
  const DisplayTree tree(strip, false);
  TriangleMesh slanted = strip;
  for (dvec3& p : slanted.vertices) p.z = 0.04 * p.x - 0.01;
  const std::vector<double> edges{-0.5, 0, 0.5};
  std::vector<double> shares;
  EXPECT_LT(polls_of([&] { shares = area_shares(tree, slanted.vertices, slanted.triangles, edges, 1); }), 40000u);
  EXPECT_NEAR(shares[1], 0.25, 0.03);
  EXPECT_NEAR(shares[1] + shares[2], 1, 1e-9);
}

TEST(AreaShares, OfNoAreaAreNothing) {
  const DisplayTree tree(shapes::grid(2), false);
  const std::vector<dvec3> points(3, dvec3(1));
  const std::vector<glm::uvec3> triangle{{0, 1, 2}};
  const std::vector<double> edges{0};
  EXPECT_EQ(area_shares(tree, points, triangle, edges), (std::vector<double>{0, 0}));
}

}  // namespace
