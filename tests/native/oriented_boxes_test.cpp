// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/oriented_boxes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "geometry/closest_point.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using Corners = std::array<dvec3, 3>;

/// Needles of any width down to none around a line, a point among them.
std::vector<Corners> needles(shapes::Random& random, double width) {
  const dvec3 along = glm::normalize(random.point());
  std::vector<Corners> triangles;
  for (int i = 0; i < 6; ++i) {
    Corners t;
    for (dvec3& corner : t) corner = 0.3 * random.normal(random.engine) * along + width * random.point();
    triangles.push_back(t);
  }
  triangles.push_back({along, along, along});
  return triangles;
}

// A box that is a little too far away would hide the nearest triangle.
TEST(OrientedBoxes, AreNeverFartherThanTheirTriangles) {
  shapes::Random random(1);
  for (const double width : {0.3, 1e-3, 1e-7, 1e-12, 1e-17, 0.0}) {
    for (int round = 0; round < 50; ++round) {
      const std::vector<Corners> triangles = needles(random, width);
      const dvec3 centre = 0.1 * random.point();
      OrientedBoxes boxes;
      const double room = round % 2 ? 1e-6 : 0;
      boxes.fit(round % 8, std::span<const Corners>(triangles), centre, room);
      for (int i = 0; i < 200; ++i) {
        const Corners& t = triangles[i % triangles.size()];
        const double off = i % 4 == 0 ? 0 : std::pow(10.0, -double(i % 16) + 4);
        const dvec3 p = t[i % 3] + off * random.point();
        double nearest = std::numeric_limits<double>::infinity();
        for (const Corners& c : triangles) {
          nearest = std::min(nearest, closest_point(p, c[0], c[1], c[2]).distance_squared);
        }
        const double short_of = std::max(0.0, std::sqrt(nearest) - room);
        if (room > 0) nearest = short_of * short_of;
        double squared[OrientedBoxes::kWidth];
        boxes.distances(p - centre, squared);
        ASSERT_LE(squared[round % 8], nearest * (1 + 1e-14) + 1e-300) << width;
        ASSERT_EQ(squared[(round + 1) % 8], std::numeric_limits<double>::infinity());
        float single[OrientedBoxes::kWidth];
        boxes.distances(p - centre, single);
        ASSERT_LE(single[round % 8], nearest * (1 + 1e-7) + 1e-37);
      }
    }
  }
}

TEST(OrientedBoxes, LieCloselyAroundNeedles) {
  shapes::Random random(2);
  for (int round = 0; round < 50; ++round) {
    const dvec3 along = glm::normalize(random.point()), across = glm::normalize(glm::cross(along, random.point()));
    std::vector<Corners> triangles;
    for (int i = 0; i < 8; ++i) triangles.push_back({0.001 * i * across, along, 0.001 * (i + 1) * across});
    OrientedBoxes boxes;
    EXPECT_LT(boxes.fit(0, std::span<const Corners>(triangles), dvec3(0), 0), 1.5 * 0.008);
    double squared[OrientedBoxes::kWidth];
    boxes.distances(0.5 * along - 0.02 * across, squared);
    EXPECT_GT(squared[0], 0.01 * 0.01);
  }
}

}  // namespace
