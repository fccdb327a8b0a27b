// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/edge_flips.h"

#include <gtest/gtest.h>

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

}  // namespace
