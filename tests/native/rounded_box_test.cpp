// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/rounded_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "shapes.h"

namespace {

using tolvol::RoundedBox;

TEST(RoundedBox, HasItsPointsAndHardlyMore) {
  tolvol::shapes::Random random(7);
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 p = random.point(), q = random.point();
    RoundedBox box, other;
    EXPECT_TRUE(box.empty());
    box.add(p), other.add(q), box.add(other);
    EXPECT_FALSE(box.empty());
    for (int k = 0; k < 3; ++k) {
      const double least = std::min(p[k], q[k]), most = std::max(p[k], q[k]);
      ASSERT_LE(box.lower[k], least);
      ASSERT_GE(box.lower[k], least - 1.2e-7 * std::abs(least));
      ASSERT_GE(box.upper[k], most);
      ASSERT_LE(box.upper[k], most + 1.2e-7 * std::abs(most));
    }
  }
}

TEST(RoundedBox, WhatIsAFloatStaysAsItIs) {
  RoundedBox box;
  box.add(glm::dvec3(-0.25, 0, 1));
  EXPECT_EQ(box.lower, glm::vec3(-0.25, 0, 1));
  EXPECT_EQ(box.upper, glm::vec3(-0.25, 0, 1));
}

}  // namespace
