// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/closest_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace {

using glm::dvec3;
using tolvol::closest_point;
using tolvol::ClosestPoint;
using tolvol::is_beyond;
using Long = glm::vec<3, long double>;

/// How far the distance of q can be above the true one, relative to the lengths involved, by duality: every point x of
/// the triangle has |p - x| >= u . (p - x) for any unit vector u, and the right side is least at a corner. Tried for u
/// are the direction from the witness to p and that direction made orthogonal to each edge and to the face. Also checks
/// that the witness is a point of the triangle.
double excess(const dvec3& p, const dvec3& a, const dvec3& b, const dvec3& c) {
  const ClosestPoint q = closest_point(p, a, b, c);
  const double size = std::max({glm::length(a - b), glm::length(b - c), glm::length(c - a)});
  const double scale = std::max({size, glm::length(p - a), glm::length(p - b), glm::length(p - c)});
  EXPECT_GE(std::min({q.weights.x, q.weights.y, q.weights.z}), 0);
  EXPECT_NEAR(q.weights.x + q.weights.y + q.weights.z, 1, 4e-16);
  const double coordinates = std::max({glm::length(a), glm::length(b), glm::length(c)});
  EXPECT_LE(glm::length(q.point - (q.weights.x * a + q.weights.y * b + q.weights.z * c)), 4e-15 * coordinates);
  EXPECT_DOUBLE_EQ(q.distance_squared, glm::dot(p - q.point, p - q.point));

  const Long at(p), corner[3] = {Long(a), Long(b), Long(c)}, r = at - Long(q.point);
  const auto without = [](Long u, const Long& edge) {
    for (int i = 0; i < 2 && edge != Long(0); ++i) u -= glm::dot(u, edge) / glm::dot(edge, edge) * edge;
    return u;
  };
  int longest = 0;
  Long edge[3];
  for (int i = 0; i < 3; ++i) {
    edge[i] = corner[(i + 1) % 3] - corner[i];
    if (glm::dot(edge[i], edge[i]) > glm::dot(edge[longest], edge[longest])) longest = i;
  }
  const Long height = without(edge[(longest + 1) % 3], edge[longest]);
  const Long face = without(without(without(r, edge[longest]), height), edge[longest]);
  long double bound = 0;
  for (const Long& u : {r, without(r, edge[0]), without(r, edge[1]), without(r, edge[2]), face}) {
    if (u == Long(0)) continue;
    const auto along = [&](int i) { return glm::dot(u, at - corner[i]); };
    bound = std::max(bound, std::min({along(0), along(1), along(2)}) / glm::length(u));
  }
  return double((glm::length(r) - bound) / scale);
}

TEST(ClosestPoint, EveryRegion) {
  const dvec3 a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);
  const struct {
    dvec3 p, expected;
  } cases[] = {{{1, 1, 3}, {1, 1, 0}},  {{-1, -2, 1}, a},        {{9, 1, 1}, b},         {{1, 9, 1}, c},
               {{2, -1, 1}, {2, 0, 0}}, {{-3, 3, 0}, {0, 3, 0}}, {{3, 3, 5}, {2, 2, 0}}, {{0, 0, 0}, a},
               {{1, 1, 0}, {1, 1, 0}},  {{2, 2, -1}, {2, 2, 0}}};
  for (const auto& [p, expected] : cases) {
    for (const auto& [x, y, z] : {std::tuple{a, b, c}, {b, c, a}, {c, a, b}, {a, c, b}}) {
      const ClosestPoint q = closest_point(p, x, y, z);
      EXPECT_LT(glm::length(q.point - expected), 1e-15) << p.x << ' ' << p.y << ' ' << p.z;
      EXPECT_NEAR(q.distance_squared, glm::dot(p - expected, p - expected), 1e-14);
    }
  }
}

TEST(ClosestPoint, DegenerateTrianglesAreSegmentsOrPoints) {
  const dvec3 a(1, 1, 1), b(3, 1, 1);
  for (const auto& [x, y, z] :
       {std::tuple{a, b, b}, {a, a, b}, {b, a, b}, {a, b, 0.5 * (a + b)}, {a, 0.25 * a + 0.75 * b, b}}) {
    EXPECT_EQ(closest_point({2, 4, 1}, x, y, z).distance_squared, 9);
    EXPECT_EQ(closest_point({5, 1, 1}, x, y, z).distance_squared, 4);
    EXPECT_EQ(closest_point({0, 1, 1}, x, y, z).distance_squared, 1);
  }
  EXPECT_EQ(closest_point({1, 1, 3}, a, a, a).distance_squared, 4);
  EXPECT_EQ(closest_point(a, a, a, a).distance_squared, 0);
}

TEST(ClosestPoint, RandomTrianglesAtRoundingLevel) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  auto point = [&] { return dvec3(normal(random), normal(random), normal(random)); };
  double worst = 0;
  for (int i = 0; i < 20000; ++i) worst = std::max(worst, excess(point(), point(), point(), point()));
  EXPECT_LT(worst, 1e-14);
}

TEST(ClosestPoint, NoWeightIsNegativeAtAnEdge) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  auto point = [&] { return dvec3(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < 20000; ++i) {
    const dvec3 a = point(), b = point(), c = point();
    const glm::dvec3 weights = closest_point(glm::mix(b, c, uniform(random)), a, b, c).weights;
    ASSERT_GE(std::min({weights.x, weights.y, weights.z}), 0) << i;
  }
}

// No point that is moved by rounding seems to be nearer than a corner that is nearest.
TEST(ClosestPoint, IsExactlyACornerThatIsSurelyNearest) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return dvec3(uniform(random), uniform(random), uniform(random)); };
  int sure = 0;
  for (int i = 0; i < 200000; ++i) {
    const double length = std::pow(10, -8 * std::abs(uniform(random))),
                 width = std::pow(10, -16 * std::abs(uniform(random)));
    const dvec3 a = vector(), b = a + length * vector(), c = a + uniform(random) * (b - a) + length * width * vector();
    const dvec3 p = a + std::pow(10, -8 * std::abs(uniform(random))) * vector();
    const double noise = tolvol::corner_noise(4);
    if (!(glm::dot(p - a, b - a) < -noise && glm::dot(p - a, c - a) < -noise)) continue;
    ++sure;
    for (const ClosestPoint& q : {closest_point(p, a, b, c), closest_point(p, c, a, b), closest_point(p, b, c, a),
                                  closest_point(p, a, c, b), closest_point(p, b, a, c), closest_point(p, c, b, a)}) {
      ASSERT_EQ(q.point, a) << i;
      ASSERT_EQ(q.distance_squared, glm::dot(p - a, p - a));
    }
  }
  EXPECT_GT(sure, 10000);
}

// Needles and slivers of every thinness, asked from their plane, from close by and from afar.
TEST(ClosestPoint, NeedlesAtRoundingLevel) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  auto point = [&] { return dvec3(normal(random), normal(random), normal(random)); };
  double worst = 0;
  for (int i = 0; i < 40000; ++i) {
    const double height = std::pow(10.0, -17 * uniform(random)), off = std::pow(10.0, 2 - 18 * uniform(random));
    dvec3 t[3];
    t[0] = point(), t[1] = point();
    t[2] = glm::mix(t[0], t[1], uniform(random) * 1.2 - 0.1) + height * point();
    const dvec3 on = glm::mix(glm::mix(t[0], t[1], uniform(random)), t[2], uniform(random));
    worst = std::max(worst, excess(on + off * point(), t[i % 3], t[(i + 1) % 3], t[(i + 2) % 3]));
  }
  EXPECT_LT(worst, 1e-14);
}

TEST(ClosestPoint, AnyScale) {
  const dvec3 a(0, 0, 0), b(4, 0, 0), c(0, 4, 0), p(1, 1, 3);
  for (const double scale : {1e-300, 1e-150, 1e-80, 1e80, 1e150, 1e300}) {
    const ClosestPoint q = closest_point(p * scale, a * scale, b * scale, c * scale);
    EXPECT_LT(glm::length((q.point / scale) - dvec3(1, 1, 0)), 1e-14) << scale;
    if (scale >= 1e-150 && scale <= 1e150) {
      EXPECT_NEAR(q.distance_squared / scale / scale, 9, 1e-13) << scale;
    }
  }
  // A small triangle far from the point: the distance keeps all its bits.
  EXPECT_EQ(closest_point({0, 0, 1}, a * 1e-200, b * 1e-200, c * 1e-200).distance_squared, 1);
  EXPECT_TRUE(std::isfinite(closest_point({1e308, 0, 0}, dvec3(-1e308, 0, 0), dvec3(-1e308, 1, 0), dvec3(0)).point.x));
}

TEST(ClosestPoint, APointThatIsNotFiniteHasNoDistance) {
  const dvec3 a(0, 0, 0), b(4, 0, 0);
  for (const double x : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const double height : {4.0, 1e-9}) {
      for (int i = 0; i < 3; ++i) {
        dvec3 p(1, 1, 3);
        p[i] = x;
        EXPECT_FALSE(std::isfinite(closest_point(p, a, b, {0, height, 0}).distance_squared)) << x << " at " << i;
      }
    }
  }
}

// Where a plane is said to show that a triangle is beyond, the witness is; and a plane that is far away shows it.
TEST(ClosestPoint, BeyondOnlyWhereTheWitnessIs) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal(0, 1);
  const auto vector = [&] { return dvec3(normal(random), normal(random), normal(random)); };
  int shown = 0, far = 0;
  for (int i = 0; i < 60000; ++i) {
    const double flat = std::pow(10, -(i % 18)), place = i % 3 ? 0 : std::pow(10, i % 8);
    const dvec3 base = place * vector(), a = base + vector(), b = a + vector(),
                c = glm::mix(a, b, 0.3) + flat * vector();
    const dvec3 p = i % 5 ? base + vector() : a + std::pow(10, -(i % 16)) * vector();
    const double squared = closest_point(p, a, b, c).distance_squared;
    EXPECT_FALSE(is_beyond(p, a, b, c, squared)) << i;
    EXPECT_FALSE(is_beyond(p, a, b, c, std::numeric_limits<double>::infinity()));
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double height = std::abs(glm::dot(glm::normalize(normal), p - a));
    for (const double share : {0.9, 0.99999}) {
      const bool beyond = is_beyond(p, a, b, c, share * height * height);
      EXPECT_TRUE(!beyond || squared > share * height * height);
      if (place == 0 && flat > 1e-6 && height > 1e-3) ++far, shown += beyond;
    }
  }
  EXPECT_EQ(shown, far);
  EXPECT_GT(far, 10000);
  const dvec3 o(0), x(1, 0, 0), y(0, 1, 0), p(0.2, 0.2, 1);
  for (const double scale : {1e-200, 1e200}) EXPECT_FALSE(is_beyond(scale * p, scale * o, scale * x, scale * y, 0));
  EXPECT_FALSE(is_beyond(p, o, x, x, 0.1));
  EXPECT_TRUE(is_beyond(p, o, x, y, 0.99));
  const dvec3 beside(0.3, -0.1, 0), above(0.3, 0.2, 0), tip(0.5, 1e-3, 0);
  for (const auto& [a, b, c] : {std::array{o, x, tip}, {tip, o, x}, {x, o, tip}}) {
    EXPECT_TRUE(is_beyond(beside, a, b, c, 0.0099));
    EXPECT_TRUE(is_beyond(above, a, b, c, 0.039));
    EXPECT_FALSE(is_beyond(dvec3(0.5, 5e-4, 0), a, b, c, 0));
  }
}

}  // namespace
