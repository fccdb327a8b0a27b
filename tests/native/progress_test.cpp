// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/progress.h"

#include <gtest/gtest.h>

namespace {

using tolvol::Progress;

TEST(Progress, OfAStageNeverFalls) {
  Progress progress;
  progress.begin("a");
  progress.update(0.5);
  progress.update(0.2);
  EXPECT_EQ(progress.fraction(), 0.5);
  progress.begin("b");
  EXPECT_EQ(progress.fraction(), 0);
}

TEST(Progress, PartsFollowEachOtherAndPartsOfPartsAreInThem) {
  Progress progress;
  {
    const Progress::Part whole(&progress, 0.5, 1);
    {
      const Progress::Part half(&progress, 0, 0.5);
      progress.begin("a");
      EXPECT_EQ(progress.fraction(), 0.5);
      progress.update(1);
      EXPECT_EQ(progress.fraction(), 0.75);
    }
    const Progress::Part half(&progress, 0.5, 1);
    progress.update(0);
    EXPECT_EQ(progress.fraction(), 0.75);
    progress.update(0.5);
    EXPECT_EQ(progress.fraction(), 0.875);
  }
  progress.begin("b");
  EXPECT_EQ(progress.fraction(), 0);
  const Progress::Part of_nothing(nullptr, 0, 0.5);
}

TEST(Progress, APartEndsWhereACallIsCancelled) {
  Progress progress;
  progress.cancel();
  EXPECT_THROW(
      {
        const Progress::Part part(&progress, 0.5, 1);
        progress.update(0.5);
      },
      tolvol::Cancelled);
  progress.begin("a");
  EXPECT_EQ(progress.fraction(), 0);
}

}  // namespace
