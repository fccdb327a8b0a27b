// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/triangle_mesh.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <tuple>

namespace {

using namespace tolvol;

TEST(TriangleMesh, EqualPositionsAreWeldedToTheFirst) {
  EXPECT_TRUE(weld_equal_positions({}).empty());
  EXPECT_EQ(weld_equal_positions(std::vector{glm::dvec3(1)}), std::vector<std::uint32_t>{0});
  // Few coordinates, so that many are equal and many share their place in the table.
  for (const unsigned values : {1u, 2u, 5u, 40u}) {
    std::mt19937 engine(values);
    std::vector<glm::dvec3> vertices;
    for (int i = 0; i < 3000; ++i) {
      const double sign = engine() % 2 ? 1 : -1;  // -0 too
      vertices.emplace_back(sign * (engine() % values), engine() % values * 0x1p-40, engine() % values);
    }
    std::map<std::tuple<double, double, double>, std::uint32_t> first;
    const std::vector<std::uint32_t> welded = weld_equal_positions(vertices);
    for (std::uint32_t i = 0; i < vertices.size(); ++i) {
      const glm::dvec3& p = vertices[i];
      ASSERT_EQ(welded[i], first.try_emplace({p.x, p.y, p.z}, i).first->second) << "vertex " << i;
    }
  }
}

}  // namespace
