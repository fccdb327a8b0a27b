// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/part.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "check/witness.h"
#include "geometry/closest_point.h"

namespace tolvol {
namespace {

using glm::dvec3;

dvec3 random_point(std::mt19937& engine) {
  std::uniform_real_distribution<double> u(-1, 1);
  return {u(engine), u(engine), u(engine)};
}

double area(const Part& p) {
  return 0.5 * glm::length(glm::cross(p.corners[1] - p.corners[0], p.corners[2] - p.corners[0]));
}

double area(const std::vector<Part>& parts) {
  double sum = 0;
  for (const Part& p : parts) sum += area(p);
  return sum;
}

double distance_to(const dvec3& p, const std::vector<Part>& parts) {
  double nearest2 = std::numeric_limits<double>::infinity();
  for (const Part& t : parts)
    nearest2 = std::min(nearest2, closest_point(p, t.corners[0], t.corners[1], t.corners[2]).distance_squared);
  return std::sqrt(nearest2);
}

/// Every point of `whole` is in one of the parts, which overlap nowhere.
void expect_tiles(const Part& whole, const std::vector<Part>& parts, std::mt19937& engine) {
  EXPECT_NEAR(area(parts), area(whole), 1e-12);
  std::uniform_real_distribution<double> u(0, 1);
  for (int i = 0; i < 20; ++i) {
    const double s = u(engine), t = u(engine) * (1 - s);
    const auto& [a, b, c] = whole.corners;
    EXPECT_LT(distance_to(a + s * (b - a) + t * (c - a), parts), 1e-14);
  }
  for (const Part& p : parts) EXPECT_EQ(p.cuts, whole.cuts + 1);
}

TEST(Part, SplitsIntoQuartersAndNeedlesIntoHalves) {
  std::mt19937 engine(1);
  int halved = 0;
  for (int i = 0; i < 500; ++i) {
    const Part whole{{random_point(engine), random_point(engine), random_point(engine)}, 3};
    std::vector<Part> parts;
    split(whole, parts);
    expect_tiles(whole, parts, engine);
    halved += parts.size() == 2;
    EXPECT_TRUE(parts.size() == 2 || parts.size() == 4);
    for (const Part& p : parts) EXPECT_LE(longest_squared(p), longest_squared(whole));
  }
  EXPECT_GT(halved, 50);
  EXPECT_LT(halved, 450);
}

TEST(Part, CutsAlongTheEdgeThatRunsBelow) {
  std::mt19937 engine(2);
  constexpr double kLeast = 0.1;
  int cuts = 0;
  for (int i = 0; i < 2'000; ++i) {
    const Part whole{{random_point(engine), random_point(engine), random_point(engine)}, 2, 7};
    const dvec3 corners[3] = {random_point(engine), random_point(engine), random_point(engine)};
    std::vector<Part> parts;
    if (!cut(whole, {corners[0], corners[1], corners[2]}, kLeast, parts)) {
      EXPECT_TRUE(parts.empty());
      continue;
    }
    ++cuts;
    ASSERT_EQ(parts.size(), 3u);
    expect_tiles(whole, parts, engine);
    // One of the three planes, through an edge and along the normal, has all of each part on one side.
    const dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
    int planes = 0;
    for (int edge = 0; edge < 3; ++edge) {
      const dvec3 &a = corners[edge], &b = corners[(edge + 1) % 3];
      const dvec3 inwards = glm::normalize(glm::cross(normal, b - a));
      const auto crosses = [&](const Part& p) {
        double high = 0, low = 0;
        for (const dvec3& x : p.corners)
          high = std::max(high, glm::dot(inwards, x - a)), low = std::max(low, -glm::dot(inwards, x - a));
        return std::min(high, low);
      };
      planes += crosses(whole) > kLeast &&
                std::none_of(parts.begin(), parts.end(), [&](const Part& p) { return crosses(p) > 1e-12; });
    }
    EXPECT_EQ(planes, 1);
    for (const Part& p : parts) EXPECT_EQ(p.of, 7u);
  }
  EXPECT_GT(cuts, 200);
}

TEST(Part, CutsASegmentAtTheEndOfAnother) {
  const Part whole{{{0, 0.1, 0}, {1, 0.1, 0}, {1, 0.1, 0}}};
  std::vector<Part> parts;
  ASSERT_TRUE(cut(whole, {dvec3(-1, 0, 0), dvec3(0.3, 0, 0), dvec3(0.3, 0, 0)}, 0.01, parts));
  ASSERT_EQ(parts.size(), 2u);
  double length = 0;
  for (const Part& p : parts) {
    EXPECT_EQ(p.corners[1], p.corners[2]);
    EXPECT_NEAR(std::min(std::abs(p.corners[0].x - 0.3), std::abs(p.corners[1].x - 0.3)), 0, 1e-15);
    length += glm::length(p.corners[1] - p.corners[0]);
  }
  EXPECT_NEAR(length, 1, 1e-15);
  parts.clear();
  split(whole, parts);
  ASSERT_EQ(parts.size(), 2u);
  for (const Part& p : parts) EXPECT_NEAR(glm::length(p.corners[1] - p.corners[0]), 0.5, 1e-15);
}

TEST(Part, IsNotCutWhereThatBringsNothing) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kFar = std::numeric_limits<double>::infinity();
  const WitnessTriangle triangle(dvec3(0, 0, 0), dvec3(1, 0, 0), dvec3(0, 1, 0));
  const WitnessTriangle point(dvec3(0, 0, 0), dvec3(0, 0, 0), dvec3(0, 0, 0));
  const Part inside{{{0.1, 0.1, 5}, {0.5, 0.1, 5}, {0.1, 0.5, 5}}},
      beyond{{{-0.05, 0.1, 0}, {0.5, 0.1, 0}, {0.1, 0.5, 0}}}, no_number{{{kNan, 0, 0}, {-1, 0, 0}, {1, 0, 0}}},
      endless{{{kFar, 0, 0}, {-1, 0, 0}, {1, 0, 0}}};
  std::vector<Part> parts;
  EXPECT_FALSE(cut(inside, triangle, 0.1, parts)) << "it is too high, not too wide";
  EXPECT_FALSE(cut(beyond, triangle, 0.1, parts)) << "a strip narrower than what is asked for";
  EXPECT_TRUE(cut(beyond, triangle, 0.01, parts));
  parts.clear();
  EXPECT_FALSE(cut(beyond, point, 0.01, parts));
  EXPECT_FALSE(cut(no_number, triangle, 0.1, parts));
  EXPECT_FALSE(cut(endless, triangle, 0.1, parts));
  EXPECT_TRUE(parts.empty());
}

}  // namespace
}  // namespace tolvol
