// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/rounded_box.h"

#include <gtest/gtest.h>

#include <cmath>

#include "shapes.h"

namespace {

using tolvol::Box;
using tolvol::BoxRounding;
using tolvol::RoundedBox;
using tolvol::shapes::Random;

/// Points of every size, and pairs of coordinates that are next to each other among the doubles.
class Points {
 public:
  explicit Points(const glm::dvec3& origin) : origin_(origin) {}
  glm::dvec3 operator()() {
    glm::dvec3 p = origin_ + std::pow(10.0, 20 * random_.point().x) * random_.point();
    for (int k = 0; k < 3; ++k) {
      if (random_.below(2) == 0) p[k] = std::nextafter(last_[k], random_.below(2) == 0 ? -HUGE_VAL : HUGE_VAL);
    }
    return last_ = p;
  }

 private:
  Random random_{7};
  glm::dvec3 origin_, last_{0};
};

const glm::dvec3 kOrigins[] = {glm::dvec3(0), {1, -2, 3}, {1e9, -1e9, 1e-9}, {1e37, 1e39, -1e300}};
const double kSizes[] = {1, 1e-30, 1e30, 0, 1e-300, 1e300};

TEST(RoundedBox, BoxesThatMeetDoSoRounded) {
  for (const glm::dvec3& origin : kOrigins) {
    Points points(origin);
    int met = 0;
    for (int i = 0; i < 60'000; ++i) {
      const BoxRounding rounding(origin, kSizes[i % 6]);
      Box a, b;
      a.add(points()), b.add(points()), a.add(points()), b.add(points());
      if (!meet(a, b)) continue;
      ++met;
      ASSERT_TRUE(meet(rounding(a), rounding(b))) << i;
    }
    EXPECT_GT(met, 3000);
  }
}

TEST(RoundedBox, TheBoxAroundARoundedOneHasTheBox) {
  for (const glm::dvec3& origin : kOrigins) {
    Points points(origin);
    for (int i = 0; i < 60'000; ++i) {
      const BoxRounding rounding(origin, kSizes[i % 6]);
      Box box;
      box.add(points()), box.add(points());
      const Box around = rounding.around(rounding(box));
      for (int k = 0; k < 3; ++k) {
        ASSERT_LE(around.lower[k], box.lower[k]) << i;
        ASSERT_GE(around.upper[k], box.upper[k]) << i;
      }
    }
  }
}

TEST(RoundedBox, WithoutAnOriginItHasTheCoordinatesAsTheyAre) {
  const RoundedBox rounded = BoxRounding()({glm::dvec3(-0.25, 0, 1), glm::dvec3(0.5, 3, 1)});
  EXPECT_LT(glm::length(rounded.lower - glm::vec3(-0.25, 0, 1)), 1e-6);
  EXPECT_LT(glm::length(rounded.upper - glm::vec3(0.5, 3, 1)), 1e-6);
}

TEST(RoundedBox, ABoxGrowsByAMillionthOfItsDistance) {
  const BoxRounding rounding(glm::dvec3(1e6));
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    Box box;
    box.add(1e6 + random.point()), box.add(1e6 + random.point());
    const Box around = rounding.around(rounding(box));
    for (int k = 0; k < 3; ++k) {
      ASSERT_GE(around.lower[k], box.lower[k] - 1e-6 * std::abs(box.lower[k] - 1e6) - 1e-8);
      ASSERT_LE(around.upper[k], box.upper[k] + 1e-6 * std::abs(box.upper[k] - 1e6) + 1e-8);
    }
  }
}

TEST(RoundedBox, AnEmptyBoxMeetsNothing) {
  const BoxRounding rounding;
  const RoundedBox all = rounding({glm::dvec3(-HUGE_VAL), glm::dvec3(HUGE_VAL)});
  EXPECT_TRUE(meet(all, rounding({glm::dvec3(1e300), glm::dvec3(1e300)})));
  EXPECT_TRUE(rounding(Box()).empty());
  EXPECT_TRUE(rounding.around(rounding(Box())).empty());
  EXPECT_FALSE(meet(all, rounding(Box())));
}

}  // namespace
