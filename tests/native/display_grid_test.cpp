// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/display_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "reference/hierarchy.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// A sphere of radius 1 about the origin.
TriangleMesh sphere(unsigned n) {
  TriangleMesh mesh = shapes::box(n);
  for (dvec3& p : mesh.vertices) p = glm::normalize(p - 0.5);
  return mesh;
}

TriangleMesh turned(TriangleMesh mesh) {
  for (glm::uvec3& t : mesh.triangles) std::swap(t.y, t.z);
  return mesh;
}

DisplayGrid::Options with(double precision) { return {.precision = precision, .threads = 1}; }

dvec3 node(const DisplayGrid& display, const dvec3& p) { return (p - display.grid.origin) / display.grid.spacing; }

/// The share of the places within the tolerance where distance(display, place in nodes) is off by 5 % of it or more.
template <class Distance>
double share_off(const TriangleMesh& reference, double tolerance, double precision, Distance&& distance) {
  const DisplayGrid display(reference, false, tolerance, with(precision));
  const Hierarchy hierarchy(reference);
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-1.2, 1.2);
  int off = 0, inside = 0;
  while (inside < 3000) {
    const dvec3 p(uniform(engine), uniform(engine), uniform(engine));
    const double truth = hierarchy.nearest(p).distance;
    if (truth > tolerance) continue;
    ++inside;
    const double shown = std::abs(distance(display, node(display, p))) * display.grid.spacing;
    off += !(std::abs(shown - truth) < 0.05 * tolerance);
  }
  return off / 3000.0;
}

TEST(DisplayGrid, InterpolatedDistancesAreGoodOnAFineGridAndTrianglesOnACoarseOneToo) {
  TriangleMesh box = shapes::box(2);
  for (dvec3& p : box.vertices) p = 1.6 * p - 0.8;
  const auto interpolated = [](const DisplayGrid& d, const dvec3& p) { return d.interpolated(p); };
  const auto nearest = [](const DisplayGrid& d, const dvec3& p) { return d.nearest(p); };
  EXPECT_LT(share_off(box, 0.1, 8, interpolated), 0.002);
  EXPECT_GT(share_off(box, 0.1, 0.5, interpolated), 0.05) << "edges are rounded off";
  EXPECT_LT(share_off(box, 0.1, 0.5, nearest), 0.005);
  EXPECT_LT(share_off(sphere(8), 0.05, 0.5, nearest), 0.01);
}

TEST(DisplayGrid, NearestIsNeverLessThanTheTruth) {
  const TriangleMesh reference = sphere(40);
  const DisplayGrid display(reference, false, 0.02, with(0.3));
  const Hierarchy hierarchy(reference);
  std::mt19937 engine(6);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 3000; ++i) {
    const dvec3 p = (1 + 0.01 * normal(engine)) * glm::normalize(dvec3(normal(engine), normal(engine), normal(engine)));
    EXPECT_GE(std::abs(display.nearest(node(display, p))) * display.grid.spacing, hierarchy.nearest(p).distance - 1e-6);
  }
}

TEST(DisplayGrid, InsideOfAClosedReferenceIsWhatItEnclosesHoweverItsFacesRun) {
  for (const double precision : {0.7, 4.0}) {
    for (const bool mirrored : {false, true}) {
      for (const TriangleMesh& reference : {sphere(12), turned(sphere(12))}) {
        const DisplayGrid display(reference, mirrored, 0.1, with(precision));
        EXPECT_TRUE(display.closed);
        for (const double radius : {0.93, 1.05}) {
          const dvec3 p = node(display, radius * glm::normalize(dvec3(1, 0.3, 0.2)));
          EXPECT_EQ(display.interpolated(p) < 0, radius < 1) << precision << mirrored;
          EXPECT_EQ(display.nearest(p) < 0, radius < 1) << precision << mirrored;
        }
      }
    }
  }
}

TEST(DisplayGrid, OfAnOpenReferenceTheFrontIsOutsideUnlessMirrored) {
  for (const bool mirrored : {false, true}) {
    const DisplayGrid display(shapes::grid(4), mirrored, 0.1, with(4));
    EXPECT_FALSE(display.closed);
    const dvec3 above = node(display, {0.4, 0.4, 0.05});
    EXPECT_EQ(display.interpolated(above) > 0, !mirrored);
    EXPECT_EQ(display.nearest(above) > 0, !mirrored);
  }
}

TEST(DisplayGrid, KeepsTheLimits) {
  const auto nodes = [](DisplayGrid::Options options) {
    options.threads = 1;
    return DisplayGrid(sphere(4), false, 0.05, options).grid.nodes;
  };
  const glm::ivec3 free = nodes({}), narrow = nodes({.longest = 64}), few = nodes({.nodes = 50000});
  EXPECT_GT(free.x, 160);
  EXPECT_LE(std::max({narrow.x, narrow.y, narrow.z}), 64);
  EXPECT_GT(narrow.x, 40) << "not coarser than it must be";
  EXPECT_LE(few.x * few.y * few.z, 50000);
  EXPECT_GT(few.x * few.y * few.z, 20000);
}

TEST(AreaShares, OfASlantedSquareAreThoseOfItsHeights) {
  const DisplayGrid display(shapes::grid(4), false, 0.1, with(4));
  // From 0.02 below the reference to 0.06 above it, a quarter below.
  TriangleMesh slanted = shapes::grid(7);
  for (dvec3& p : slanted.vertices) p = node(display, {p.x, p.y, 0.08 * p.x - 0.02});
  const double scale = 1 / display.grid.spacing;
  const std::vector<double> edges{-0.05 * scale, 0, 0.02 * scale, 0.1 * scale};
  for (const bool nearest : {false, true}) {
    for (const unsigned threads : {1u, 3u}) {
      const std::vector<double> shares =
          area_shares(display, nearest, slanted.vertices, slanted.triangles, edges, threads);
      ASSERT_EQ(shares.size(), 5u);
      EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1, 1e-9);
      EXPECT_EQ(shares[0], 0);
      EXPECT_NEAR(shares[1], 0.25, 0.003);
      EXPECT_NEAR(shares[2], 0.25, 0.003);
      EXPECT_NEAR(shares[3], 0.5, 0.003);
      EXPECT_EQ(shares[4], 0);
    }
  }
}

TEST(AreaShares, OfNoAreaAreNothing) {
  const DisplayGrid display(shapes::grid(2), false, 0.1, with(2));
  const std::vector<dvec3> points(3, dvec3(1));
  const std::vector<glm::uvec3> triangle{{0, 1, 2}};
  const std::vector<double> edges{0};
  EXPECT_EQ(area_shares(display, false, points, triangle, edges), (std::vector<double>{0, 0}));
}

}  // namespace
