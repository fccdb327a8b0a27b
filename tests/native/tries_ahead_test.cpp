// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/tries_ahead.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>
#include <vector>

namespace {

using namespace tolvol;
using Steps = std::vector<std::uint32_t>;

constexpr auto kNothing = [](std::uint32_t, std::size_t) {};

/// Step s reads around vertices s and s + 1.
std::optional<std::size_t> found(const TriesAhead& ahead, std::uint32_t step) {
  return ahead.found(step, std::array{step, step + 1});
}

void change(TriesAhead& ahead, std::uint32_t vertex) {
  ahead.advance();
  ahead.note_change(vertex);
}

TEST(TriesAhead, KeepWhatNothingChanged) {
  Team team(2);
  TriesAhead ahead(team, 4, 10, 11);
  std::array<std::uint32_t, 4> results{};
  const std::size_t first =
      ahead.run(Steps{2, 5, 7}, [&](std::uint32_t step, std::size_t slot) { results[slot] = step; });
  EXPECT_EQ(found(ahead, 2), first);
  change(ahead, 0), change(ahead, 4), change(ahead, 10);
  for (const std::uint32_t step : {2u, 5u, 7u}) {
    ASSERT_TRUE(found(ahead, step)) << "what it read is as it was";
    EXPECT_EQ(results[*found(ahead, step)], step);
  }
  EXPECT_FALSE(found(ahead, 3)) << "was not tried";
}

TEST(TriesAhead, DropWhatReadSomethingThatChanged) {
  Team team(2);
  TriesAhead ahead(team, 4, 10, 11);
  ahead.run(Steps{2, 5, 7}, kNothing);
  change(ahead, 6);
  EXPECT_TRUE(found(ahead, 2));
  EXPECT_FALSE(found(ahead, 5));
  EXPECT_TRUE(found(ahead, 7));
  ahead.run(Steps{5}, kNothing);
  EXPECT_TRUE(found(ahead, 5)) << "was tried again since";
  change(ahead, 5);
  EXPECT_FALSE(found(ahead, 5));
}

TEST(TriesAhead, ForgetTheOldest) {
  Team team(2);
  TriesAhead ahead(team, 4, 10, 11);
  ahead.run(Steps{0, 1, 2}, kNothing);
  ahead.run(Steps{5, 6}, kNothing);
  EXPECT_FALSE(found(ahead, 0)) << "its slot was taken";
  for (const std::uint32_t step : {1u, 2u, 5u, 6u}) EXPECT_TRUE(found(ahead, step));
  ahead.drop(0), ahead.drop(2);
  EXPECT_FALSE(found(ahead, 2));
  EXPECT_TRUE(found(ahead, 6)) << "is in the slot that 0 was in";
  ahead.drop_all();
  EXPECT_FALSE(found(ahead, 6));
}

TEST(TriesAhead, OneThreadTriesNothingAhead) {
  TriesAhead ahead;
  Steps tried;
  ahead.run(Steps{3, 4}, [&](std::uint32_t step, std::size_t) { tried.push_back(step); });
  EXPECT_EQ(tried, Steps{3});
  EXPECT_FALSE(found(ahead, 3));
}

/// A row of numbers. A step that finds its two neighbours far apart brings them together.
struct Row {
  explicit Row(unsigned threads) : team(threads), values(kSteps + 1) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<int>(i * i * 7919 % 1000);
    if (!team.alone()) ahead = TriesAhead(team, 2 * kAhead, kSteps, values.size());
    results.resize(ahead.slot_count());
  }

  void run() {
    for (int round = 0; round < 5; ++round) {
      for (std::uint32_t step = 0; step < kSteps; ++step) {
        const auto kept = found(ahead, step);
        used += kept.has_value();
        const int middle = results[kept ? *kept : try_from(step)];
        ahead.drop(step);
        if (middle < 0) continue;
        order.push_back(step);
        values[step] = values[step + 1] = middle;
        ahead.advance();
        ahead.note_change(step), ahead.note_change(step + 1);
      }
    }
  }

  std::size_t try_from(std::uint32_t step) {
    Steps steps(ahead.alone() ? 1 : std::min<std::size_t>(kAhead, kSteps - step));
    std::iota(steps.begin(), steps.end(), step);
    return ahead.run(steps, [&](std::uint32_t s, std::size_t slot) {
      const int a = values[s], b = values[s + 1];
      results[slot] = std::abs(a - b) > 100 ? (a + b) / 2 : -1;
    });
  }

  static constexpr std::uint32_t kSteps = 500, kAhead = 6;
  Team team;
  TriesAhead ahead;
  std::vector<int> values, results;
  Steps order;
  std::size_t used = 0;
};

TEST(TriesAhead, SameOrderOnAnyThreads) {
  Row alone(1);
  alone.run();
  EXPECT_EQ(alone.used, 0u);
  EXPECT_GT(alone.order.size(), 100u);
  for (const unsigned threads : {2u, 4u}) {
    Row row(threads);
    row.run();
    EXPECT_EQ(row.order, alone.order) << threads << " threads";
    EXPECT_EQ(row.values, alone.values) << threads << " threads";
    EXPECT_GT(row.used, 100u) << "something was found ahead";
    EXPECT_LT(row.used, 5u * Row::kSteps) << "and something dropped";
  }
}

}  // namespace
