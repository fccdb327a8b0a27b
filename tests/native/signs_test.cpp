// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/signs.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "field/scatter.h"
#include "laid_out.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

DistanceGrid grid_of(const TriangleMesh& mesh, double tolerance, double precision) {
  DistanceGrid grid = laid_out(mesh, tolerance, precision);
  scatter(mesh, grid, 1);
  return grid;
}

/// How many nodes are negative, and how many of all disagree with inside(position).
template <class Inside>
std::pair<int, int> counted(const DistanceGrid& g, const std::vector<float>& distance, Inside&& inside) {
  int negative = 0, unlike = 0;
  for (int z = 0; z < g.nodes.z; ++z) {
    for (int y = 0; y < g.nodes.y; ++y) {
      for (int x = 0; x < g.nodes.x; ++x) {
        const bool found = std::signbit(distance[g.index(x, y, z)]);
        negative += found, unlike += found != inside(g.origin + g.spacing * dvec3(x, y, z));
      }
    }
  }
  return {negative, unlike};
}

TEST(Signs, NegativeInsideAtEveryNodeAndTheSameMagnitudes) {
  const auto in_box = [](const dvec3& p) {
    const dvec3 out = glm::abs(p - 0.5) - 0.5;
    return std::max({out.x, out.y, out.z}) < -1e-9;
  };
  for (const double tolerance : {0.03, 0.6}) {  // with nodes beyond the band inside, and without
    const TriangleMesh mesh = shapes::box(2);
    const DistanceGrid grid = grid_of(mesh, tolerance, tolerance / 0.021);
    const std::vector<float> distance = signed_distance(mesh, grid);
    const auto [negative, unlike] = counted(grid, distance, in_box);
    EXPECT_GT(negative, 10000);
    EXPECT_EQ(unlike, 0);
    for (std::size_t i = 0; i < distance.size(); ++i) ASSERT_EQ(std::abs(distance[i]), grid.distance[i]);
  }
}

TEST(Signs, OfAnOpenMeshBelowItsExtrusion) {
  const TriangleMesh plate = shapes::grid(3);
  const DistanceGrid grid = grid_of(plate, 0.3, 7);
  const auto [negative, unlike] =
      counted(grid, signed_distance(plate, grid), [](const dvec3& p) { return p.z < -1e-9; });
  EXPECT_GT(negative, 1000);
  EXPECT_EQ(unlike, 0);
}

TEST(Signs, ThreadsDoNotMatterAndASignedGridStays) {
  const TriangleMesh mesh = shapes::torus(24, 0.05);
  DistanceGrid grid = grid_of(mesh, 0.1, 2);
  const std::vector<float> one = signed_distance(mesh, grid, 1);
  EXPECT_EQ(one, signed_distance(mesh, grid, 3));
  grid.distance = one, grid.is_signed = true;
  EXPECT_EQ(one, signed_distance(mesh, grid));
}

TEST(Signs, SpreadFromOneNodeToAll) {
  DistanceGrid grid;
  grid.nodes = {5, 4, 3}, grid.pitch = 8;
  for (const glm::ivec3& at : {glm::ivec3(0, 0, 0), glm::ivec3(2, 1, 1), glm::ivec3(4, 3, 2)}) {
    std::vector<float> distance(96, 1.0f);
    std::vector<std::uint8_t> known(96, 0);
    distance[grid.index(at.x, at.y, at.z)] = -2, known[grid.index(at.x, at.y, at.z)] = 1;
    spread_signs(grid, known, distance);
    for (int x = 0; x < 5; ++x) {
      for (int y = 0; y < 4; ++y) {
        for (int z = 0; z < 3; ++z) EXPECT_EQ(distance[grid.index(x, y, z)], glm::ivec3(x, y, z) == at ? -2 : -1);
      }
    }
  }
}

}  // namespace
