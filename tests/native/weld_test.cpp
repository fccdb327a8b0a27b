// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/weld.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>
#include <tuple>

#include "base/parallel.h"
#include "many.h"
#include "polls.h"

namespace {

using namespace tolvol;

template <class Vector>
std::vector<std::uint32_t> weld(const std::vector<Vector>& vertices, unsigned threads = 1) {
  Team team(threads);
  return weld_equal_positions(std::span<const Vector>(vertices), team);
}

/// Few coordinates, so that many are equal and many share their place in a table.
template <class Vector>
std::vector<Vector> crowded(unsigned values, std::size_t count) {
  using Real = typename Vector::value_type;
  std::mt19937 engine(values);
  std::vector<Vector> vertices;
  for (std::size_t i = 0; i < count; ++i) {
    const double sign = engine() % 2 ? 1 : -1;  // -0 too
    vertices.emplace_back(Real(sign * (engine() % values)), Real(engine() % values * 0x1p-40), Real(engine() % values));
  }
  return vertices;
}

template <class Vector>
void expect_the_first_of_equal_ones() {
  EXPECT_TRUE(weld(std::vector<Vector>()).empty());
  EXPECT_EQ(weld(std::vector{Vector(1)}), std::vector<std::uint32_t>{0});
  for (const unsigned values : {1u, 2u, 5u, 40u}) {
    const std::vector<Vector> vertices = crowded<Vector>(values, 9000);
    std::map<std::tuple<double, double, double>, std::uint32_t> first;
    const std::vector<std::uint32_t> welded = weld(vertices);
    for (std::uint32_t i = 0; i < vertices.size(); ++i) {
      const Vector& p = vertices[i];
      ASSERT_EQ(welded[i], first.try_emplace({p.x, p.y, p.z}, i).first->second) << "vertex " << i;
    }
  }
}

TEST(Weld, EqualPositionsAreWeldedToTheFirst) {
  expect_the_first_of_equal_ones<glm::dvec3>();
  expect_the_first_of_equal_ones<glm::vec3>();
}

TEST(Weld, WhatIsNoNumberStaysApart) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(weld(std::vector<glm::dvec3>(3, glm::dvec3(0, none, 0))), (std::vector<std::uint32_t>{0, 1, 2}));
  const std::vector<glm::dvec3> more(many(100'000), glm::dvec3(none));
  EXPECT_LT(polls_of([&] { EXPECT_EQ(weld(more).back(), more.size() - 1); }), 1000u) << "the table has places for them";
}

TEST(Weld, ThreadsFindTheSame) {
  const std::vector<glm::vec3> vertices = crowded<glm::vec3>(90, 250'000);
  const std::vector<std::uint32_t> alone = weld(vertices);
  for (const unsigned threads : {2u, 3u, 8u}) EXPECT_EQ(weld(vertices, threads), alone);
}

// The lowest bits of such coordinates are 0. A hash that does not bring the others down takes 60,000 polls.
TEST(Weld, VerticesAlongAnAxisHavePlacesOfTheirOwn) {
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<glm::dvec3> vertices(many(128'000), glm::dvec3(1, 2, 3));
    for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i][axis] = double(i);
    std::vector<std::uint32_t> welded;
    EXPECT_LT(polls_of([&] { welded = weld(vertices); }), 1000u);
    for (std::uint32_t i = 0; i < vertices.size(); ++i) ASSERT_EQ(welded[i], i);
  }
}

}  // namespace
