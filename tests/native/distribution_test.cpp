// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/distribution.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

namespace {

using tolvol::Distribution;
using tolvol::Sum;

TEST(Sum, KeepsSmallTermsBesideLargeOnes) {
  Sum sum;
  sum.add(1e16);
  for (int i = 0; i < 1000; ++i) sum.add(1);
  sum.add(-1e16);
  EXPECT_EQ(sum.value(), 1000);
}

TEST(Distribution, SharesAndPercentilesOfAFewNumbers) {
  const Distribution few({{3, 1}, {1, 2}, {2, 1}});
  EXPECT_EQ(few.share_beyond(0), 1);
  EXPECT_EQ(few.share_beyond(1), 0.5);
  EXPECT_EQ(few.share_beyond(2.5), 0.25);
  EXPECT_EQ(few.share_beyond(3), 0);
  EXPECT_EQ(few.percentile(0), 1);
  EXPECT_EQ(few.percentile(49), 1);
  EXPECT_EQ(few.percentile(51), 2);
  EXPECT_EQ(few.percentile(74), 2);
  EXPECT_EQ(few.percentile(100), 3);
  EXPECT_EQ(few.percentile(50, 0.01), 2);
}

TEST(Distribution, PercentilesAreThoseOfSortedNumbers) {
  std::mt19937 random(1);
  std::lognormal_distribution<double> numbers;
  std::vector<Distribution::Part> parts;
  for (int i = 0; i < 10000; ++i) parts.push_back({numbers(random), 1});
  std::vector<double> sorted;
  for (const Distribution::Part& part : parts) sorted.push_back(part.value);
  std::sort(sorted.begin(), sorted.end());
  const Distribution many(std::move(parts));
  for (int percent = 1; percent < 100; ++percent) {
    const std::size_t last = static_cast<std::size_t>(percent) * 100 - 1;
    EXPECT_EQ(many.percentile(percent - 0.001), sorted[last]) << percent;
    EXPECT_NEAR(many.share_beyond(sorted[last]), 1 - percent / 100.0, 1e-12) << percent;
  }
}

TEST(Distribution, NumbersThatAreAllNothing) {
  const Distribution zero({{0, 1}, {0, 3}});
  EXPECT_EQ(zero.share_beyond(0), 0);
  EXPECT_EQ(zero.percentile(100), 0);
}

}  // namespace
