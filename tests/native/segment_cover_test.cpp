// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/segment_cover.h"

#include <gtest/gtest.h>

#include <utility>

#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

struct Triangles {
  explicit Triangles(TriangleMesh m) : mesh(std::move(m)), witnesses(mesh), hierarchy(mesh) {}
  bool cover(const dvec3& a, const dvec3& b, double limit) const {
    return covers_segment(witnesses, hierarchy, a, b, limit);
  }
  TriangleMesh mesh;
  Witnesses witnesses;
  Hierarchy hierarchy;
};

/// Two unit squares in the plane z = 0, `gap` apart.
TriangleMesh two_squares(double gap) {
  TriangleMesh mesh;
  for (const double x : {-1 - gap / 2, gap / 2}) {
    const auto n = static_cast<unsigned>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {{x, 0, 0}, {x + 1, 0, 0}, {x + 1, 1, 0}, {x, 1, 0}});
    mesh.triangles.insert(mesh.triangles.end(), {{n, n + 1, n + 2}, {n, n + 2, n + 3}});
  }
  return mesh;
}

TEST(SegmentCover, BridgesAGapAsWideAsTwoIntervalsReach) {
  // At height 3 a distance of 5 reaches 4 beyond the rim, from both sides: a gap of 8, in hundredths.
  const auto bridged = [](double gap) {
    const Triangles squares(two_squares(gap));
    const dvec3 a(-0.5, 0.5, 0.03), b(0.5, 0.4, 0.03);
    EXPECT_EQ(squares.cover(a, b, 0.05), squares.cover(b, a, 0.05));
    return squares.cover(a, b, 0.05);
  };
  EXPECT_TRUE(bridged(0));
  EXPECT_TRUE(bridged(0.0796));
  EXPECT_FALSE(bridged(0.0804));
}

TEST(SegmentCover, HoldsToTheLastBitsAlongManyTriangles) {
  const Triangles plane(shapes::grid(30));
  for (const double height : {0.1, 0.3, 0.99, 1.0}) {
    const dvec3 a(0.013, 0.027, 0.01 * height), b(0.97, 0.93, 0.01 * height);
    EXPECT_TRUE(plane.cover(a, b, 0.01)) << height;
    EXPECT_FALSE(plane.cover(a, b, 0.01 * height - 1e-13)) << height;
    // A point is a segment.
    EXPECT_TRUE(plane.cover(a, a, 0.01)) << height;
    EXPECT_FALSE(plane.cover(a, a, 0.01 * height - 1e-13)) << height;
  }
  // One end that leaves the plane, and one that leaves its rim.
  EXPECT_FALSE(plane.cover({0.1, 0.1, 0}, {0.9, 0.9, 0.0101}, 0.01));
  EXPECT_TRUE(plane.cover({0.1, 0.1, 0}, {0.9, 0.9, 0.0099}, 0.01));
  EXPECT_FALSE(plane.cover({0.5, 0.5, 0}, {1.0101, 0.5, 0}, 0.01));
  EXPECT_TRUE(plane.cover({0.5, 0.5, 0}, {1.0099, 0.5, 0}, 0.01));
  EXPECT_FALSE(plane.cover({0.5, 0.5, 0}, {1e300, 0.5, 0}, 0.01));
}

}  // namespace
