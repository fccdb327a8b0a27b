// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/display_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

DisplayGrid::Options with(double precision) { return {.precision = precision, .threads = 1}; }

/// The distance at the node that is nearest to a place, in spacings.
float at(const DisplayGrid& display, const dvec3& p) {
  const glm::ivec3 node(glm::round((p - display.grid.origin) / display.grid.spacing));
  return display.grid.distance[display.grid.index(node.x, node.y, node.z)];
}

TEST(DisplayGrid, DistancesAreThoseOfTheSurface) {
  const DisplayGrid display(shapes::sphere(30), false, 0.1, with(4));
  const DistanceGrid& grid = display.grid;
  for (int z = 0; z < grid.nodes.z; ++z) {
    for (int y = 0; y < grid.nodes.y; ++y) {
      for (int x = 0; x < grid.nodes.x; ++x) {
        const double truth = glm::length(grid.origin + grid.spacing * dvec3(x, y, z)) - 1;
        if (std::abs(truth) > 0.09) continue;
        EXPECT_NEAR(grid.distance[grid.index(x, y, z)] * grid.spacing, truth, 0.002) << "the sphere has flat faces";
      }
    }
  }
}

TEST(DisplayGrid, InsideOfAClosedReferenceIsWhatItEnclosesHoweverItsFacesRun) {
  for (const double precision : {0.7, 4.0}) {
    for (const bool mirrored : {false, true}) {
      for (const TriangleMesh& reference : {shapes::sphere(12), shapes::turned(shapes::sphere(12))}) {
        const DisplayGrid display(reference, mirrored, 0.2, with(precision));
        EXPECT_TRUE(display.closed);
        for (const double radius : {0.8, 1.2}) {
          const dvec3 p = radius * glm::normalize(dvec3(1, 0.3, 0.2));
          EXPECT_EQ(at(display, p) < 0, radius < 1) << precision << mirrored;
        }
      }
    }
  }
}

TEST(DisplayGrid, OfAnOpenReferenceTheFrontIsOutsideUnlessMirrored) {
  for (const bool mirrored : {false, true}) {
    const DisplayGrid display(shapes::grid(4), mirrored, 0.1, with(4));
    EXPECT_FALSE(display.closed);
    EXPECT_EQ(at(display, {0.4, 0.4, 0.05}) > 0, !mirrored);
  }
}

TEST(DisplayGrid, KeepsTheLimits) {
  const auto nodes = [](DisplayGrid::Options options) {
    options.threads = 1;
    return DisplayGrid(shapes::sphere(4), false, 0.05, options).grid.nodes;
  };
  const glm::ivec3 free = nodes({}), narrow = nodes({.longest = 64}), few = nodes({.nodes = 50000});
  EXPECT_GT(free.x, 160);
  EXPECT_LE(std::max({narrow.x, narrow.y, narrow.z}), 64);
  EXPECT_GT(narrow.x, 40) << "not coarser than it must be";
  EXPECT_LE(few.x * few.y * few.z, 50000);
  EXPECT_GT(few.x * few.y * few.z, 20000);
}

}  // namespace
