// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/morton_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace {

using namespace tolvol;

TEST(MortonOrder, SortsByCodeAndKeepsTheOrderOfEqualOnes) {
  for (const unsigned count : {0u, 1u, 7u, 5000u}) {
    std::mt19937_64 engine(count);
    Unfilled<MortonKey> keys;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint64_t code = engine() >> 1;
      keys.push_back({i % 3 ? code : code % 8 << 40, i, ~i});
    }
    Unfilled<MortonKey> expected = keys;
    std::stable_sort(expected.begin(), expected.end(), [](auto& a, auto& b) { return a.code < b.code; });
    for (const unsigned threads : {1u, 2u, 5u}) {
      Team team(threads);
      Unfilled<MortonKey> sorted = keys;
      sort_by_code(sorted, team);
      ASSERT_TRUE(std::equal(sorted.begin(), sorted.end(), expected.begin(), [](auto& a, auto& b) {
        return a.code == b.code && a.triangle == b.triangle && a.slice == b.slice;
      })) << count;
    }
  }
}

// The highest bit tells the halves along z apart, the next one those along y, then x.
TEST(MortonOrder, TheBitsOfACodeAreHalvesOfSpace) {
  EXPECT_EQ(morton_code(glm::dvec3(-1)), 0u);
  EXPECT_EQ(morton_code(glm::dvec3(-2)), 0u);
  EXPECT_EQ(morton_code(glm::dvec3(1)), (std::uint64_t(1) << 63) - 1);
  EXPECT_EQ(morton_code({-1, -1, 0}), std::uint64_t(1) << 62);
  EXPECT_EQ(morton_code({-1, 0, -1}), std::uint64_t(1) << 61);
  EXPECT_EQ(morton_code({0, -1, -1}), std::uint64_t(1) << 60);
  EXPECT_EQ(morton_code({-0.5, -1, -1}), std::uint64_t(1) << 57);
}

}  // namespace
