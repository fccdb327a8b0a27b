// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/distance_grid.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/errors.h"
#include "base/simd.h"
#include "field/scatter.h"
#include "geometry/closest_point.h"
#include "laid_out.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

DistanceGrid grid_of(const TriangleMesh& mesh, double tolerance, double precision, unsigned threads = 1) {
  DistanceGrid grid = laid_out(mesh, tolerance, precision);
  scatter(mesh, grid, threads);
  return grid;
}

double distance_to(const TriangleMesh& mesh, std::uint32_t i, const dvec3& p) {
  const glm::uvec3 t = mesh.triangles[i];
  return std::sqrt(closest_point(p, mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]).distance_squared);
}

/// Calls visit(position, distance, id) for every node.
template <class Visit>
void for_nodes(const DistanceGrid& g, Visit&& visit) {
  for (int z = 0; z < g.nodes.z; ++z) {
    for (int y = 0; y < g.nodes.y; ++y) {
      for (int x = 0; x < g.nodes.x; ++x) {
        visit(g.origin + g.spacing * dvec3(x, y, z), g.distance[g.index(x, y, z)], g.triangle[g.index(x, y, z)]);
      }
    }
  }
}

TEST(Scatter, ExactAgainstBruteForce) {
  const TriangleMesh mesh = shapes::torus(12, 0.05);
  const DistanceGrid grid = grid_of(mesh, 0.2, 2);
  int within = 0;
  for_nodes(grid, [&](const dvec3& p, float distance, std::uint32_t id) {
    double exact = 1e9;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) exact = std::min(exact, distance_to(mesh, i, p));
    if (exact < grid.band * (1 - 1e-5)) {
      ++within;
      ASSERT_NE(id, DistanceGrid::kNone);
      ASSERT_NEAR(distance, exact, 1e-5);
      ASSERT_NEAR(distance_to(mesh, id, p), exact, 1e-5) << "the id is of a closest triangle";
    } else if (exact > grid.band * (1 + 1e-5)) {
      ASSERT_EQ(id, DistanceGrid::kNone);
      ASSERT_NEAR(distance, grid.band, 1e-5);
    }
  });
  EXPECT_GT(within, 1000);
}

TEST(Scatter, NeverUnderestimatesOnNeedlesAndDegenerates) {
  TriangleMesh mesh;
  for (int i = 2; i <= 7; ++i) {
    const unsigned n = unsigned(mesh.vertices.size());
    const double y = 0.2 * i;
    mesh.vertices.insert(mesh.vertices.end(),
                         {{0, y, 0}, {1, y + 0.1, 0.3}, {0.5, y + 0.05 + std::pow(10.0, -i), 0.15}});
    mesh.triangles.emplace_back(n, n + 1, n + 2);
  }
  const unsigned n = unsigned(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}});
  mesh.triangles.emplace_back(n, n + 1, n);          // a segment
  mesh.triangles.emplace_back(n + 2, n + 2, n + 2);  // a point
  const DistanceGrid grid = grid_of(mesh, 0.1, 4);
  for_nodes(grid, [&](const dvec3& p, float distance, std::uint32_t) {
    double exact = 1e9;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) exact = std::min(exact, distance_to(mesh, i, p));
    // A needle too thin for float32 is measured to its edges: too far by at most half its height.
    if (exact < grid.band * 0.999) {
      ASSERT_NEAR(distance, exact, 1e-4);
    }
  });
}

TEST(Scatter, ThreadsAndInstructionsDoNotChangeABit) {
  const TriangleMesh mesh = shapes::torus(40, 0.02);
  const DistanceGrid one = grid_of(mesh, 0.05, 2);
  for (const unsigned threads : {2u, 3u, 7u}) {
    const DistanceGrid other = grid_of(mesh, 0.05, 2, threads);
    EXPECT_EQ(one.distance, other.distance);
    EXPECT_EQ(one.triangle, other.triangle);
  }
  const Simd best = simd_path();
  simd_path() = Simd::portable;
  const DistanceGrid portable = grid_of(mesh, 0.05, 2);
  simd_path() = best;
  EXPECT_EQ(one.distance, portable.distance);
  EXPECT_EQ(one.triangle, portable.triangle);
}

TEST(Layout, EveryPointWithinTheToleranceHasAllEightNodes) {
  const TriangleMesh mesh = shapes::torus(12);
  const double tolerance = 0.1;
  const DistanceGrid grid = grid_of(mesh, tolerance, 0.5);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3 t = mesh.triangles[i];
    const dvec3 a = mesh.vertices[t.x], n = glm::normalize(glm::cross(mesh.vertices[t.y] - a, mesh.vertices[t.z] - a));
    for (const double side : {-0.999, 0.999}) {
      const dvec3 p = a + side * tolerance * n;
      const glm::ivec3 cell(glm::floor((p - grid.origin) / grid.spacing));
      for (int k = 0; k < 8; ++k) {
        const glm::ivec3 node = cell + glm::ivec3(k & 1, (k >> 1) & 1, k >> 2);
        ASSERT_NE(grid.triangle[grid.index(node.x, node.y, node.z)], DistanceGrid::kNone);
      }
      ASSERT_NE(grid.triangle_near(p), DistanceGrid::kNone);
    }
  }
  EXPECT_EQ(grid.triangle_near(dvec3(100)), DistanceGrid::kNone);
  EXPECT_EQ(grid.triangle_near(dvec3(std::numeric_limits<double>::quiet_NaN())), DistanceGrid::kNone);
  EXPECT_EQ(DistanceGrid().triangle_near(dvec3(0)), DistanceGrid::kNone);
}

TEST(Layout, PrecisionLadderFitsTheBudget) {
  const Box box{dvec3(-0.5), dvec3(0.5)};
  double last = 2;
  for (const double tolerance : {0.1, 0.01, 0.001, 1e-5, 1e-9}) {
    const DistanceGrid grid = layout_grid(box, tolerance, std::nullopt);
    const double precision = tolerance / grid.spacing;
    EXPECT_LE(precision, last);
    const double step = std::round(std::log(precision) / std::log(0.8));
    EXPECT_NEAR(std::pow(0.8, step), precision, 1e-12 * precision) << "1, 0.8, 0.64, ...";
    const std::size_t memory = std::size_t(grid.pitch) * grid.nodes.y * grid.nodes.z * 8;
    EXPECT_LE(memory, kGridBudget);
    EXPECT_TRUE(precision == 1 || memory > kGridBudget / 3)
        << "a step takes about half of the memory; padding takes the rest";
    last = precision;
  }
  // Whoever gives more memory gets a finer grid, and no more than 1 node per tolerance.
  const auto precision_in = [&](std::size_t memory) {
    return 0.002 / layout_grid(box, 0.002, std::nullopt, memory).spacing;
  };
  EXPECT_LT(precision_in(kGridBudget / 4), precision_in(kGridBudget));
  EXPECT_LT(precision_in(kGridBudget), precision_in(2 * kGridBudget));
  EXPECT_DOUBLE_EQ(precision_in(kLargestGrid), 1);
  EXPECT_DOUBLE_EQ(0.1 / layout_grid(box, 0.1, 3.0).spacing, 3.0);
  EXPECT_THROW(layout_grid(box, 0.1, 0.0), InvalidInput);
  EXPECT_THROW(layout_grid(box, 0.1, std::numeric_limits<double>::quiet_NaN()), InvalidInput);
  try {
    layout_grid(box, 1e-3, 64.0);
    FAIL() << "must not fit";
  } catch (const ResourceLimit& error) {
    EXPECT_NE(std::string(error.what()).find("fits"), std::string::npos) << error.what();
  }
}

TEST(Layout, OneSpacingGivesTheGridsOfThePaper) {
  // [Botsch04, Table 1]: tolerance 1 % of the diagonal, precision 1.1, the box enlarged by the tolerance on each side.
  // Extents of the same scans as they are handed on today, their axes in the order of the table.
  struct Row {
    const char* name;
    dvec3 extent, printed;
  };
  const Row rows[] = {{"bunny", {0.155699, 0.154334, 0.120674}, {74, 73, 58}},
                      {"horse", {0.183341, 0.152836, 0.084006}, {85, 71, 42}},
                      {"Igea, the paper's Venus", {0.069112, 0.099338, 0.099076}, {53, 74, 74}}};
  constexpr double kPrecision = 1.1;
  for (const Row& row : rows) {
    const double tolerance = 0.01 * glm::length(row.extent);
    const dvec3 enlarged = row.extent + 2 * tolerance;
    const auto farthest = [&](double h) {
      const dvec3 off = glm::abs(glm::ceil(enlarged / h) + 1.0 - row.printed);
      return std::max({off.x, off.y, off.z});
    };
    EXPECT_LE(farthest(layout_grid({dvec3(0), row.extent}, tolerance, kPrecision).spacing), 2) << row.name;
    const double diagonal = glm::length(enlarged),
                 cells = std::ceil(kPrecision * diagonal / (tolerance * std::sqrt(3)));
    EXPECT_GT(farthest(diagonal / cells), 20) << row.name << ": h = D / R with R as printed is another grid";
  }
}

}  // namespace
