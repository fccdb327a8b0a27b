// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/near_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <vector>

#include "geometry/closest_point.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

TEST(NearPoints, AFarReachIsThatOfItsPointAlone) {
  const TriangleMesh mesh = shapes::grid(20);
  std::vector<dvec3> points;
  std::vector<double> reach;
  for (int i = 0; i < 400; ++i)
    points.emplace_back((i % 20 + 0.5) / 20, (i / 20 + 0.5) / 20, 0), reach.push_back(0.001);
  reach.front() = 2;
  std::size_t visited = 0;
  for_each_near(points, reach, mesh, [&](std::uint32_t point, std::span<const std::uint32_t> triangles) {
    EXPECT_GE(triangles.size(), point == 0 ? 800u : 1u);
    visited += triangles.size();
  });
  EXPECT_LT(visited, 800u + 400 * 17);
}

TEST(NearPoints, NoTriangleWithinReachIsLeftOut) {
  // Needles and short triangles, some of which are segments or points, and points on, beside and away from them.
  TriangleMesh mesh;
  shapes::Random random(11);
  for (std::uint32_t i = 0; i < 300; ++i) {
    const dvec3 a = random.point(), b = i % 2 ? random.point() : a + 0.01 * random.point();
    const dvec3 c = i % 10 == 3 ? b : b + 0.01 * random.point();
    mesh.vertices.insert(mesh.vertices.end(), {i % 10 == 4 ? c : a, i % 10 == 4 ? c : b, c});
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  std::vector<dvec3> points;
  for (std::uint32_t i = 0; i < 600; ++i) {
    const glm::uvec3 t = mesh.triangles[i / 2];
    const dvec3 on = 0.2 * mesh.vertices[t.x] + 0.3 * mesh.vertices[t.y] + 0.5 * mesh.vertices[t.z];
    points.push_back(i % 2 ? on : on + 0.002 * random.point());
  }
  for (const double reach : {0.0, 1e-15, 0.001}) {
    std::vector<int> visits(points.size(), 0);
    std::size_t within = 0, visited = 0;
    for_each_near(points, std::vector<double>(points.size(), reach), mesh,
                  [&](std::uint32_t point, std::span<const std::uint32_t> triangles) {
                    ++visits[point];
                    visited += triangles.size();
                    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
                      const glm::uvec3 t = mesh.triangles[i];
                      const ClosestPoint closest =
                          closest_point(points[point], mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]);
                      if (!(closest.distance_squared <= reach * reach)) continue;
                      ++within;
                      EXPECT_NE(std::ranges::find(triangles, i), triangles.end())
                          << point << " " << i << " at " << reach;
                    }
                  });
    EXPECT_EQ(std::ranges::count(visits, 1), 600);
    EXPECT_GT(within, reach > 0 ? 200u : 0u);
    EXPECT_LT(visited, points.size() * 17) << "no more than a few others";
  }
  for_each_near({}, {}, mesh, [](std::uint32_t, std::span<const std::uint32_t>) { ADD_FAILURE(); });
}

}  // namespace
