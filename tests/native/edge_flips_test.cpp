// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/edge_flips.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "patches.h"

namespace {

using namespace tolvol;

TEST(EdgeFlips, BringEdgesAlongARidge) {
  for (const bool across : {false, true}) {
    patches::Ridge f(across);
    EdgeFlips flips;
    const double before = f.deviations.state().energy;
    EXPECT_EQ(before > 1, across);
    const bool any = flips.flip(f.deviations);
    EXPECT_EQ(any, !f.patch.flips().empty());
    if (across) {
      EXPECT_GT(f.patch.flips().size(), 0u);
      EXPECT_LT(f.deviations.state().energy, 0.99 * before);
    } else {
      EXPECT_LE(f.deviations.state().energy, before);
    }
    for (std::uint32_t face = 0; face < f.patch.faces().size(); ++face) {
      EXPECT_GT(f.patch.normal(face).z, 0) << "nothing folds over";
    }
  }
}

TEST(EdgeFlips, FlipEachEdgeNearAVertexOnce) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> flipped;
  int place = 0;
  for (;; ++place) {
    patches::Ridge f(false);
    const std::uint32_t vertex = f.patch.find_vertex(*f.change.vertex());
    const std::vector<std::uint32_t> around = f.patch.vertices()[vertex].faces;
    if (!EdgeFlips::flip_near(f.deviations, vertex, place)) {
      EXPECT_TRUE(f.patch.flips().empty()) << "a place beyond the last edge changes nothing";
      break;
    }
    ASSERT_EQ(f.patch.flips().size(), 1u);
    const auto [a, b] = f.patch.flips()[0];
    flipped.insert(std::minmax(a, b));
    int changed = 0;
    for (const std::uint32_t face : around) changed += f.patch.faces()[face].changed;
    EXPECT_GT(changed, 0) << "one of the two faces was around the vertex";
    for (std::uint32_t face = 0; face < f.patch.faces().size(); ++face) {
      EXPECT_GE(f.patch.normal(face).z, 0) << "nothing folds over";
    }
  }
  EXPECT_EQ(flipped.size(), static_cast<std::size_t>(place));
  EXPECT_GT(place, 3);
}

}  // namespace
