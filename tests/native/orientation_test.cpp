// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/orientation.h"

#include <gtest/gtest.h>

namespace tolvol {
namespace {

TEST(Orientation, NeighboursThatRunAlongTheirEdgeAlikeAreReversed) {
  Team team(2);
  // Two triangles that look alike, one against them, one elsewhere, and one that is no more than a segment.
  const std::vector<glm::uvec3> triangles{{0, 1, 2}, {2, 1, 3}, {3, 2, 4}, {5, 6, 7}, {0, 1, 1}};
  const Orientation found = orientation(triangles, 8, team);
  EXPECT_EQ(found.part, (std::vector<std::uint32_t>{0, 0, 0, 3, 4}));
  EXPECT_EQ(found.reversed, (std::vector<bool>{false, false, true, false, false}));
}

TEST(Orientation, AnEdgeOfThreeTrianglesConnectsNone) {
  Team team(1);
  const Orientation found = orientation(std::vector<glm::uvec3>{{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}, 5, team);
  EXPECT_EQ(found.part, (std::vector<std::uint32_t>{0, 1, 2}));
}

}  // namespace
}  // namespace tolvol
