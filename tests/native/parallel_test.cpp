// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

namespace tolvol {
namespace {

TEST(Team, SharesEveryLoopWithoutLossOrRepetition) {
  for (const unsigned threads : {1u, 2u, 5u}) {
    Team team(threads);
    for (const std::size_t count : {0, 1, 3, 64, 1000}) {
      for (const std::size_t block : {1, 7, 2000}) {
        for (int again = 0; again < 20; ++again) {
          std::vector<int> visits(count, 0);
          team.run(count, block, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) ++visits[i];
          });
          ASSERT_EQ(visits, std::vector<int>(count, 1)) << threads << " threads, " << count << " by " << block;
        }
      }
    }
  }
}

TEST(Team, SeesWhatTheCallerWroteBetweenLoops) {
  Team team(3);
  std::vector<std::size_t> values(500);
  std::iota(values.begin(), values.end(), std::size_t{0});
  for (int turn = 1; turn <= 200; ++turn) {
    team.run(values.size(), 1, [&](std::size_t i, std::size_t) { values[i] += 1; });
    for (std::size_t& value : values) value += 1;
  }
  for (std::size_t i = 0; i < values.size(); ++i) ASSERT_EQ(values[i], i + 400);
}

TEST(Team, HandsTheFirstExceptionOnAndGoesOnAfterIt) {
  Team team(4);
  for (int again = 0; again < 50; ++again) {
    std::atomic<int> entered{0};
    const auto failing = [&](std::size_t i, std::size_t) {
      ++entered;
      if (i % 10 == 3) throw std::runtime_error("at " + std::to_string(i));
    };
    EXPECT_THROW(team.run(1000, 1, failing), std::runtime_error);
    EXPECT_LT(entered, 1000);
  }
  std::atomic<int> sum{0};
  team.run(100, 1, [&](std::size_t i, std::size_t) { sum += static_cast<int>(i); });
  EXPECT_EQ(sum, 4950);
}

TEST(Team, IsAloneWithOneThread) {
  EXPECT_TRUE(Team(1).alone());
  EXPECT_TRUE(Team(0).alone());
  EXPECT_FALSE(Team(2).alone());
}

}  // namespace
}  // namespace tolvol
