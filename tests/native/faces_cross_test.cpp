// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/faces_cross.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "shapes.h"

namespace {

using glm::dvec3;
using tolvol::Corners;
using tolvol::faces_cross;
using tolvol::faces_cross_exactly;
using tolvol::is_degenerate;

const Corners kFlat{dvec3(0, 0, 0), dvec3(4, 0, 0), dvec3(0, 4, 0)};

/// The answer must not depend on which triangle comes first, nor on the order of their corners.
bool cross(Corners a, Corners b) {
  const bool answer = faces_cross(a, b);
  for (int i = 0; i < 36; ++i) {
    std::next_permutation(a.begin(), a.end(), [](const dvec3& p, const dvec3& q) {
      return std::lexicographical_compare(&p.x, &p.x + 3, &q.x, &q.x + 3);
    });
    if (i % 6 == 0) std::rotate(b.begin(), b.begin() + 1, b.end());
    if (i % 18 == 0) std::swap(b[0], b[1]);
    EXPECT_EQ(faces_cross(a, b), answer);
    EXPECT_EQ(faces_cross(b, a), answer);
    EXPECT_EQ(faces_cross_exactly(a, b), answer);
  }
  return answer;
}

TEST(FacesCross, TrianglesWithoutACommonCorner) {
  EXPECT_TRUE(cross(kFlat, {dvec3(1, 1, -1), dvec3(1, 1, 1), dvec3(9, 9, 0)}));    // pierced
  EXPECT_TRUE(cross(kFlat, {dvec3(1, 1, 0), dvec3(1, 1, 1), dvec3(2, 2, 1)}));     // touched by a corner
  EXPECT_TRUE(cross(kFlat, {dvec3(2, 0, 0), dvec3(2, -1, 1), dvec3(2, -1, -1)}));  // touched on an edge
  EXPECT_TRUE(cross(kFlat, {dvec3(1, 1, 0), dvec3(2, 1, 0), dvec3(1, 2, 0)}));     // overlapping in one plane
  EXPECT_FALSE(cross(kFlat, {dvec3(5, 5, 0), dvec3(9, 5, 0), dvec3(5, 9, 0)}));
  EXPECT_FALSE(cross(kFlat, {dvec3(1, 1, 1e-300), dvec3(2, 1, 1), dvec3(1, 2, 1)}));
}

TEST(FacesCross, TrianglesWithOneCommonCorner) {
  EXPECT_FALSE(cross(kFlat, {dvec3(0), dvec3(1, 1, 1), dvec3(-1, 1, 1)}));
  EXPECT_FALSE(cross(kFlat, {dvec3(0), dvec3(-1, -1, -1), dvec3(-1, -1, 1)}));  // through the plane, beside it
  EXPECT_TRUE(cross(kFlat, {dvec3(0), dvec3(1, 1, -1), dvec3(1, 1, 1)}));       // through it
  EXPECT_TRUE(cross(kFlat, {dvec3(0), dvec3(9, 9, -1), dvec3(9, 9, 1)}));       // and beyond the far side
  EXPECT_TRUE(cross(kFlat, {dvec3(0), dvec3(2, 0, 0), dvec3(1, -1, 0)}));       // along a part of an edge
  EXPECT_TRUE(cross(kFlat, {dvec3(0), dvec3(2, 0, 0), dvec3(1, -1, 1)}));
  EXPECT_TRUE(cross(kFlat, {dvec3(0), dvec3(1, 1, 0), dvec3(1, 1, 1)}));     // an edge runs inside
  EXPECT_FALSE(cross(kFlat, {dvec3(0), dvec3(-1, 0, 0), dvec3(0, -1, 0)}));  // opposite, in one plane
  EXPECT_TRUE(cross(kFlat, {dvec3(0), dvec3(1, 0, 0), dvec3(0, 1, 0)}));     // one in the other
}

// Around one corner in one plane all needles are apart, but for those that lie on one another.
TEST(FacesCross, NeedlesAroundACommonCorner) {
  for (const double size : {1.0, 1e-140, 1e140}) {
    const dvec3 hub = size * dvec3(0.3, 0.1, 0.7);
    const auto needle = [&](double from, double width) {
      const auto at = [&](double angle) { return hub + size * dvec3(std::cos(angle), std::sin(angle), 0); };
      return Corners{hub, at(0.06 * from), at(0.06 * (from + width))};
    };
    for (int i = 0; i < 100; ++i) {
      for (int k = 0; k < i; ++k) EXPECT_FALSE(faces_cross(needle(i, 0.5), needle(k, 0.5)));
      EXPECT_TRUE(cross(needle(i, 0.5), needle(i + 0.4, 0.5)));
      EXPECT_TRUE(cross(needle(i, 0.5), needle(i + 0.1, 0.3)));
    }
  }
}

TEST(FacesCross, TrianglesWithACommonEdge) {
  EXPECT_FALSE(cross(kFlat, {dvec3(0), dvec3(4, 0, 0), dvec3(0, -4, 0)}));
  EXPECT_FALSE(cross(kFlat, {dvec3(0), dvec3(4, 0, 0), dvec3(0, 4, 1e-300)}));
  EXPECT_TRUE(cross(kFlat, {dvec3(0), dvec3(4, 0, 0), dvec3(9, 9, 0)}));  // folded over the edge
  EXPECT_TRUE(cross(kFlat, kFlat));
}

TEST(FacesCross, DegenerateTriangles) {
  const Corners line{dvec3(-1, 1, 0), dvec3(0, 1, 0), dvec3(2, 1, 0)}, point{dvec3(1), dvec3(1), dvec3(1)};
  EXPECT_TRUE(is_degenerate(line));
  EXPECT_TRUE(is_degenerate(point));
  EXPECT_FALSE(is_degenerate(kFlat));
  // Rounded differences of these corners are collinear, the corners are not.
  EXPECT_FALSE(is_degenerate({dvec3(1e16, 0, 0), dvec3(0, 1, 0), dvec3(1, 1, 0)}));
  EXPECT_TRUE(is_degenerate({dvec3(0.1, 0.2, 0.3), dvec3(0.2, 0.4, 0.6), dvec3(0.4, 0.8, 1.2)}));
  EXPECT_TRUE(cross(kFlat, line));
  EXPECT_FALSE(cross(line, line));
  EXPECT_FALSE(cross(kFlat, point));
  EXPECT_TRUE(cross(kFlat, {dvec3(1, 1, 0), dvec3(1, 1, 0), dvec3(1, 1, 0)}));
  EXPECT_FALSE(cross(kFlat, {dvec3(0), dvec3(0), dvec3(0, 0, 1)}));          // from a corner, out of the plane
  EXPECT_FALSE(cross(kFlat, {dvec3(0), dvec3(0), dvec3(0)}));                // a corner
  EXPECT_FALSE(cross(kFlat, {dvec3(0), dvec3(-1, 0, 0), dvec3(-2, 0, 0)}));  // from a corner, away
  EXPECT_TRUE(cross(kFlat, {dvec3(0), dvec3(1, 1, 0), dvec3(2, 2, 0)}));     // from a corner, inwards
  EXPECT_TRUE(cross(kFlat, {dvec3(0), dvec3(1, 0, 0), dvec3(-1, 0, 0)}));    // along a part of an edge
  EXPECT_FALSE(cross(kFlat, {dvec3(0), dvec3(4, 0, 0), dvec3(2, 0, 0)}));    // the edge itself
}

// No epsilon: a change in the last bit of a coordinate decides, however far from the origin.
TEST(FacesCross, DecidesTheLastBit) {
  for (const double at : {1.0, 1e-30, 1e7, 1e30}) {
    const double next = std::nextafter(at, 2 * at);
    const Corners flat{dvec3(0, 0, at), dvec3(at, 0, at), dvec3(0, at, at)};
    const auto above = [&](double z) {
      return Corners{dvec3(at / 8, at / 8, z), dvec3(at, 0, 2 * at), dvec3(at, at, 2 * at)};
    };
    EXPECT_TRUE(cross(flat, above(at)));
    EXPECT_FALSE(cross(flat, above(next)));
  }
}

// Scaled by a power of two and moved, a pair keeps its answer as long as no coordinate is rounded.
TEST(FacesCross, KeepsTheAnswerWhenMoved) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> coordinate(-2, 2);
  int crossing = 0;
  for (int i = 0; i < 20000; ++i) {
    Corners a, b;
    for (int k = 0; k < 3; ++k) {
      a[k] = dvec3(coordinate(random), coordinate(random), coordinate(random));
      b[k] = i % 3 >= k + 1 ? a[k] : dvec3(coordinate(random), coordinate(random), coordinate(random));
    }
    const bool answer = faces_cross(a, b);
    crossing += answer;
    EXPECT_EQ(faces_cross(b, a), answer);
    EXPECT_EQ(faces_cross_exactly(a, b), answer);
    for (Corners* t : {&a, &b}) {
      for (dvec3& p : *t) p = 0x1p-20 * (p + dvec3(1e6, -3e5, 12345));
    }
    EXPECT_EQ(faces_cross(a, b), answer);
  }
  EXPECT_GT(crossing, 2000);
  EXPECT_LT(crossing, 18000);
}

}  // namespace
