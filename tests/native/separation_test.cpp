// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/separation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kAnyReach = 100;

dvec3 at(const Corners& t, const dvec3& weights) { return weights.x * t[0] + weights.y * t[1] + weights.z * t[2]; }

Corners moved(Corners t, const dvec3& by) {
  for (dvec3& p : t) p += by;
  return t;
}

/// A sheet far and wide in a plane across the z axis.
Corners plane(double z) { return {dvec3(-50, -50, z), {50, -50, z}, {0, 50, z}}; }

std::vector<Separation> separations(const Corners& face, const Corners& other, const Corners& sheet,
                                    double reach = kAnyReach) {
  std::vector<Separation> found;
  Sheet one;
  one.add(sheet);
  separate(face, other, one, reach, found);
  return found;
}

/// By how much the point that is worst placed is on the wrong side.
double depth(const std::vector<Separation>& all, const Corners& face) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Separation& s : all) most = std::max(most, s.offset - glm::dot(s.normal, at(face, s.weights)));
  return most;
}

const Corners kFlat{dvec3(0, 0, 0), {1, 0, 0}, {0, 1, 0}};

TEST(Separation, PointsToTheSideWhereTheSheetIs) {
  const Corners face = moved(kFlat, {0.1, 0.1, 0.02});
  for (const double z : {0.3, -0.3}) {
    const std::vector<Separation> found = separations(face, kFlat, plane(z));
    ASSERT_GE(found.size(), 3u);
    for (const Separation& s : found) {
      EXPECT_NEAR(s.normal.z, z > 0 ? 1 : -1, 1e-12);
      EXPECT_NEAR(s.offset, 0, 1e-12);
      EXPECT_GE(std::min({s.weights.x, s.weights.y, s.weights.z}), -1e-12);
    }
    EXPECT_NEAR(depth(found, face), z > 0 ? -0.02 : 0.02, 1e-12);
  }
}

TEST(Separation, NamesOnlyWhatIsWithinReach) {
  const Corners face = moved(kFlat, {0.1, 0.1, 0.02});
  EXPECT_TRUE(separations(face, kFlat, plane(1), 0.01).empty());
  EXPECT_EQ(separations(face, kFlat, plane(1), 0.03).size(), separations(face, kFlat, plane(1)).size());
  const Corners tilted{dvec3(0.1, 0.1, 0), {0.5, 0.1, 0.1}, {0.1, 0.5, 0.1}};
  const std::vector<Separation> found = separations(tilted, kFlat, plane(1), 0.05);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].weights.x, 1, 1e-12);
}

TEST(Separation, ThereIsNoneWhereNoSideIsMeant) {
  EXPECT_TRUE(separations(moved(kFlat, {2, 0, 0.01}), kFlat, plane(1)).empty()) << "one beside the other";
  EXPECT_TRUE(separations({kFlat[0], dvec3(0.5, 0.1, 1), dvec3(0.1, 0.5, 1)}, kFlat, plane(1)).empty()) << "neighbours";
  const Corners face = moved(kFlat, {0.1, 0.1, 0.02}), beside = moved(kFlat, {1.5, 0, 0.1});
  EXPECT_TRUE(separations(face, kFlat, beside).empty()) << "a sheet beside the other face";
  EXPECT_TRUE(separations(face, kFlat, kFlat).empty()) << "a sheet upon it";
  EXPECT_TRUE(separations(face, {kFlat[0], kFlat[1], kFlat[1]}, plane(1)).empty()) << "a face without a normal";
  const Corners upright{dvec3(0.1, 0.1, -1), {0.4, 0.1, -1}, {0.4, 0.1, 1}};
  EXPECT_TRUE(separations(upright, kFlat, plane(1)).empty()) << "seen from its edge";
}

// The gap over the overlap is least at a separation, and moving the face by the depth ends the crossing.
TEST(Separation, WhereAllHoldTheFacesDoNotCross) {
  shapes::Random random(3);
  int crossed = 0, met = 0;
  for (int i = 0; i < 3000; ++i) {
    Corners face{random.point(), random.point(), random.point()}, other{random.point(), random.point(), random.point()};
    for (Corners* t : {&face, &other}) {
      for (dvec3& p : *t) p.z *= 0.1;
    }
    const dvec3 normal = glm::normalize(glm::cross(other[1] - other[0], other[2] - other[0]));
    const dvec3 centre = (other[0] + other[1] + other[2]) / 3.0;
    Corners sheet;
    for (int k = 0; k < 3; ++k) sheet[k] = centre + 100.0 * (other[k] - centre) + 0.1 * normal;
    const std::vector<Separation> found = separations(face, other, sheet);
    const bool crosses = faces_cross(face, other);
    if (found.empty()) {
      EXPECT_FALSE(crosses) << "although they do not overlap";
      continue;
    }
    ++met;
    EXPECT_GT(glm::dot(found[0].normal, normal), 1 - 1e-9);
    EXPECT_LE(found.size(), 6u);
    const double deep = depth(found, face);
    if (crosses) {
      ++crossed;
      EXPECT_GT(deep, -1e-9);
    }
    const Corners apart = moved(face, (deep + 1e-6) * normal), into = moved(face, (deep - 1e-6) * normal);
    EXPECT_LT(depth(found, apart), 0);
    EXPECT_FALSE(faces_cross(apart, other));
    EXPECT_GT(depth(found, into), 0);
    EXPECT_TRUE(faces_cross(into, other)) << "by no more than is needed";
  }
  EXPECT_GT(crossed, 300);
  EXPECT_GT(met, crossed + 300);
}

TEST(Separation, FewFacesOfALargeSheetAreMeasured) {
  Sheet sheet;
  constexpr int kSide = 40;
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const dvec3 a(i, j, 1), b(i + 1, j, 1), c(i, j + 1, 1), d(i + 1, j + 1, 1);
      sheet.add({a, b, c});
      sheet.add({b, d, c});
    }
  }
  std::vector<Separation> found;
  const Corners other = moved(kFlat, {20.3, 20.4, 0});
  EXPECT_LE(separate(moved(other, {0.1, 0.1, 0.02}), other, sheet, kAnyReach, found), 10u);
  EXPECT_GE(found.size(), 3u);
  found.clear();
  EXPECT_EQ(separate(moved(other, {3, 0, 0.02}), other, sheet, kAnyReach, found), 0u) << "they do not overlap";
  EXPECT_TRUE(found.empty());
}

}  // namespace
