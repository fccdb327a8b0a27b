// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/collapse_queue.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace tolvol {
namespace {

/// Held against a sorted set, step by step.
class Mirror {
 public:
  explicit Mirror(std::size_t edges) : stamps_(edges, 0), queue_(stamps_), cost_(edges, kNone) {}

  void push(std::uint32_t edge, double cost) {
    drop(edge);
    queue_.push(edge, cost);
    order_.emplace(cost_[edge] = cost, edge);
  }
  void drop(std::uint32_t edge) {
    queue_.drop(edge);
    order_.erase({cost_[edge], edge});
    cost_[edge] = kNone;
  }
  /// Whether there was one.
  bool pop() {
    const auto entry = queue_.pop();
    EXPECT_EQ(entry.has_value(), !order_.empty());
    if (!entry || order_.empty()) return false;
    EXPECT_EQ(std::pair(entry->cost, entry->edge), *order_.begin());
    cost_[order_.begin()->second] = kNone;
    order_.erase(order_.begin());
    return true;
  }

 private:
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> stamps_;
  CollapseQueue queue_;
  std::vector<double> cost_;
  std::set<std::pair<double, std::uint32_t>> order_;
};

TEST(CollapseQueue, IsInOrderWhateverIsRenewedMeanwhile) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(-300, 300);
  std::uniform_int_distribution<std::uint32_t> any(0, 499);
  const auto cost = [&] {
    switch (any(random) % 8) {
      case 0:
        return 0.0;
      case 1:
        return -0.0;
      case 2:
        return 1.0;  // ties
      case 3:
        return -std::pow(10, exponent(random));
      default:
        return std::pow(10, exponent(random));
    }
  };
  Mirror mirror(500);
  for (std::uint32_t i = 0; i < 500; ++i) mirror.push(i, cost());
  for (int step = 0; step < 20000; ++step) {
    switch (any(random) % 4) {
      case 0:
        mirror.drop(any(random));
        break;
      case 1:
        mirror.pop();
        break;
      default:
        mirror.push(any(random), cost());
    }
    ASSERT_FALSE(::testing::Test::HasFailure()) << "step " << step;
  }
  while (mirror.pop()) {
  }
}

TEST(CollapseQueue, TakesCheaperOnesAfterDearerOnesWereTaken) {
  Mirror mirror(4);
  mirror.push(0, 1e9), mirror.push(1, 1e-9);
  EXPECT_TRUE(mirror.pop());
  EXPECT_TRUE(mirror.pop());
  mirror.push(2, 5.0), mirror.push(3, 1e-30), mirror.push(1, std::numeric_limits<double>::denorm_min());
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(mirror.pop());
  EXPECT_FALSE(mirror.pop());
}

}  // namespace
}  // namespace tolvol
