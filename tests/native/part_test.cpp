// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/part.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "check/witness.h"
#include "reference/closest_point.h"

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

TEST(Part, CutsOffWhatOneTriangleCovers) {
  std::mt19937 engine(2);
  constexpr double kPermitted = 0.7;
  int cut_by_one = 0, cut_by_two = 0;
  for (int i = 0; i < 5'000; ++i) {
    const Part whole{{random_point(engine), random_point(engine), random_point(engine)}};
    const WitnessTriangle t(random_point(engine), random_point(engine), random_point(engine));
    FourPoints points;
    points.set(whole.corners[0], whole.corners[1], whole.corners[2], dvec3(0));
    double d2[4];
    witness_distances(t, points, d2);
    const int near = (d2[0] <= 0.3) + (d2[1] <= 0.3) + (d2[2] <= 0.3);
    Cover cover;
    if (!cover.improve(d2, kPermitted) || cover.share == 1) continue;
    std::vector<Part> inside, rest, all;
    if (!cut(whole, cover, inside, rest)) {
      EXPECT_TRUE(inside.empty() && rest.empty());
      continue;
    }
    for (const Part& p : rest) EXPECT_LT(longest_squared(p), 0.7 * longest_squared(whole));
    ASSERT_EQ(inside.size() + rest.size(), 3u);
    EXPECT_NEAR(area(inside), cover.share * area(whole), 1e-12);
    all = inside;
    all.insert(all.end(), rest.begin(), rest.end());
    expect_tiles(whole, all, engine);
    for (const Part& p : inside) {
      for (const dvec3& x : p.corners)
        EXPECT_LT(closest_point(x, t.a, t.a + t.ab, t.a + t.ac).distance_squared, kPermitted * kPermitted);
    }
    (inside.size() == 1 ? cut_by_one : cut_by_two) += near > 0;
  }
  EXPECT_GT(cut_by_one, 20);
  EXPECT_GT(cut_by_two, 100);
}

TEST(Part, CoverTakesTheLargestShareAndNeverWhatIsNotANumber) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kFar = std::numeric_limits<double>::infinity();
  Cover cover;
  EXPECT_FALSE(cover.improve({kNan, kNan, kNan, 0}, 1));
  EXPECT_FALSE(cover.improve({4, 4, 4, 0}, 1));
  EXPECT_FALSE(cover.improve({0, kNan, 4, 0}, 1));
  EXPECT_FALSE(cover.improve({0, kFar, kFar, 0}, 1));
  EXPECT_EQ(cover.share, 0);
  EXPECT_TRUE(cover.improve({0, 4, 4, 0}, 1));
  const double small = cover.share;
  EXPECT_TRUE(cover.improve({0, 0, 4, 0}, 1));
  EXPECT_GT(cover.share, small);
  EXPECT_FALSE(cover.improve({0, 4, 4, 0}, 1));
  EXPECT_EQ(cover.distance[1], 0);
}

}  // namespace
}  // namespace tolvol
