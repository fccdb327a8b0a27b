// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/split.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace {

using namespace tolvol;
using glm::dvec3;

dvec3 twice_area(const TriangleCorners& p) { return glm::cross(p[1] - p[0], p[2] - p[0]); }

TEST(Split, PartsAreAllOfThePieceAndTurnedAlike) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto point = [&] { return dvec3(uniform(random), uniform(random), uniform(random)); };
  int threes = 0;
  for (int i = 0; i < 2000; ++i) {
    const TriangleCorners piece{point(), point(), point()}, t{point(), point(), point()};
    const Parts parts = split(piece, t, t);
    ASSERT_GE(parts.count, 2);
    threes += parts.count == 3;
    dvec3 sum(0);
    for (int k = 0; k < parts.count; ++k) {
      const dvec3 part = twice_area(parts.corners[k]);
      EXPECT_GT(glm::dot(part, twice_area(piece)), 0);
      sum += part;
    }
    EXPECT_LT(glm::distance(sum, twice_area(piece)), 1e-14);
  }
  EXPECT_GT(threes, 200);
}

// Once for each edge: then every part lies above the triangle or beside it.
TEST(Split, CutsAlongTheEdges) {
  const TriangleCorners t{dvec3(0, 0, 0), dvec3(1, 0, 0), dvec3(0, 1, 0)};
  std::vector<TriangleCorners> open{{dvec3(-1, -1, 0.2), dvec3(2.9, -1, 0.3), dvec3(-1, 2.9, 0.1)}};
  double above = 0;
  for (int round = 0; round < 3; ++round) {
    std::vector<TriangleCorners> next;
    for (const TriangleCorners& piece : open) {
      const Parts parts = split(piece, t, t);
      next.insert(next.end(), parts.corners.begin(), parts.corners.begin() + parts.count);
    }
    open.swap(next);
  }
  for (const TriangleCorners& p : open) {
    const auto inside = [](const dvec3& q) { return q.x > -1e-12 && q.y > -1e-12 && q.x + q.y < 1 + 1e-12; };
    if (std::all_of(p.begin(), p.end(), inside)) above += twice_area(p).z / 2;
  }
  EXPECT_NEAR(above, 0.5, 1e-12);
}

// A triangle without a width has no edges to cut along: it is a segment, and the piece is cut at its ends, whichever of
// its corners are equal or between the others.
TEST(Split, CutsAtTheEndsOfASegment) {
  const dvec3 p(0, 0, 0.1), q(1, 0.5, 0.1), end(0.3, 0.15, 0), other_end(1.2, 0.6, 0);
  const TriangleCorners piece{p, q, q};
  for (const dvec3& third : {end, other_end, glm::mix(end, other_end, 0.25)}) {
    for (int turn = 0; turn < 3; ++turn) {
      TriangleCorners t;
      t[turn] = end, t[(turn + 1) % 3] = other_end, t[(turn + 2) % 3] = third;
      const Parts parts = split(piece, t, t);
      ASSERT_EQ(parts.count, 2);
      EXPECT_LT(glm::distance(parts.corners[0][1], dvec3(0.3, 0.15, 0.1)), 1e-15);
      EXPECT_EQ(parts.corners[1][0], parts.corners[0][1]);
    }
  }
  const dvec3 point(0.3, 0, 0);
  EXPECT_EQ(split(piece, {point, point, point}, {point, point, point}).count, 2) << "a point has no ends: halved";
}

// A piece that stands between two sheets is cut where both are as near, so that each part has one that is nearest.
TEST(Split, CutsBetweenTwoSheets) {
  const TriangleCorners below{dvec3(-9, -9, 0), dvec3(9, -9, 0), dvec3(0, 9, 0)};
  TriangleCorners above = below;
  for (dvec3& p : above) p.z = 1;
  const TriangleCorners piece{dvec3(0), dvec3(2, 0, 0), dvec3(0, 1, 1)};
  const Parts parts = split(piece, below, above);
  ASSERT_EQ(parts.count, 3);
  for (int i = 0; i < parts.count; ++i) {
    const auto& p = parts.corners[i];
    const auto [lowest, highest] = std::minmax({p[0].z, p[1].z, p[2].z});
    EXPECT_TRUE(highest <= 0.5 || lowest >= 0.5);
  }
}

// Whichever two corners are equal, and whether it is halved or cut.
TEST(Split, SegmentsLeaveTwoThatDoNotOverlap) {
  const dvec3 p(0, 0, 0.1), q(1, 0, 0.1);
  const TriangleCorners beside{dvec3(0.3, -1, 0), dvec3(0.3, 1, 0), dvec3(9, 0, 0)}, tiny{p, p, p};
  for (const auto& [t, at] : {std::pair{beside, 0.3}, {tiny, 0.5}}) {
    for (const TriangleCorners& segment : {TriangleCorners{p, q, q}, {p, q, p}, {p, p, q}}) {
      const Parts parts = split(segment, t, t);
      ASSERT_EQ(parts.count, 2);
      double sum = 0;
      for (int k = 0; k < 2; ++k) {
        const auto [left, right] = std::minmax({parts.corners[k][0].x, parts.corners[k][1].x, parts.corners[k][2].x});
        EXPECT_NEAR(left == 0 ? right : left, at, 1e-15);
        sum += right - left;
      }
      EXPECT_NEAR(sum, 1, 1e-15);
    }
  }
}

TEST(Split, LongPiecesAreHalvedAndTinyOnesLeft) {
  const TriangleCorners t{dvec3(0), dvec3(0.1, 0, 0), dvec3(0, 0.1, 0)};
  const Parts halves = split({dvec3(0), dvec3(1, 0, 0), dvec3(0, 0.5, 0)}, t, t);
  ASSERT_EQ(halves.count, 2);
  EXPECT_EQ(halves.corners[0][2], dvec3(0.5, 0.25, 0));  // the middle of the longest edge
  EXPECT_EQ(split({dvec3(0.5), dvec3(0.5), dvec3(0.5)}, t, t).count, 0);
  EXPECT_EQ(split({dvec3(0), dvec3(1, 0, 0), dvec3(0.5, 0, 0)}, {dvec3(0.2), dvec3(0.2), dvec3(0.2)}, t).count, 2);
}

}  // namespace
