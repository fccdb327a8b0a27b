// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/replaced_faces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "measure/hausdorff.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kWithin = 0.01;

ReplacedFaces faces_of(const TriangleMesh& mesh, double distance) {
  ReplacedFaces faces;
  for (const glm::uvec3& t : mesh.triangles)
    faces.add({mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]}, {distance}, std::nullopt);
  return faces;
}

TEST(ReplacedFaces, BoundWhatLiesInTheirPlane) {
  const TriangleMesh mesh = shapes::fan(7, 0);
  ReplacedFaces faces = faces_of(mesh, 0);
  const dvec3 across[3] = {mesh.vertices[1], mesh.vertices[3], mesh.vertices[6]};
  const double bound = faces.bound(across, kWithin, nullptr).distance;
  EXPECT_LE(bound, 1e-9 * kWithin);
  EXPECT_GT(bound, 0);
  // Again and again, from where hardly any room is left.
  double distance = 0.9999 * kWithin;
  for (int i = 0; i < 1'000; ++i) {
    ReplacedFaces next = faces_of(mesh, distance);
    distance = next.bound(across, kWithin, nullptr).distance;
    ASSERT_LE(distance, 0.99991 * kWithin) << i;
  }
}

// Each part of the triangle is near a few of the faces, and only these are compared with it.
TEST(ReplacedFaces, LookAtTheFacesNearEachPart) {
  const TriangleMesh mesh = shapes::fan(400, 0);
  ReplacedFaces faces = faces_of(mesh, 0);
  const dvec3 over_forty[3] = {mesh.vertices[1], mesh.vertices[41], 0.3 * mesh.vertices[21]};
  ASSERT_LE(faces.bound(over_forty, kWithin, nullptr).distance, 1e-9 * kWithin);
  EXPECT_LT(faces.looked_at(), 10u * 400);  // there are more than a hundred parts
}

// A change that moves a vertex with very many faces asks for a bound of each of them.
TEST(ReplacedFaces, BeginNoFurtherSearchAfterVeryManyComparisons) {
  const TriangleMesh mesh = shapes::fan(400, 0);
  ReplacedFaces faces = faces_of(mesh, 0);
  const dvec3 over_forty[3] = {mesh.vertices[1], mesh.vertices[41], 0.3 * mesh.vertices[21]};
  std::size_t searches = 0, before = 0;
  for (; faces.bound(over_forty, kWithin, nullptr).distance <= kWithin; ++searches) {
    ASSERT_LT(searches, 10'000u);
    before = faces.looked_at();
  }
  EXPECT_GT(searches, 50u);
  EXPECT_EQ(faces.looked_at(), before) << "the last one gave up at once";
  EXPECT_LT(faces.looked_at(), 400'000u) << "where the reference would have been asked long ago";
}

TEST(ReplacedFaces, TakeAShareOfTheRoomThatIsLeftAndNoMore) {
  // A corner a little above their plane each time.
  const TriangleMesh mesh = shapes::fan(7, 0);
  double distance = 0;
  for (int i = 0; i < 100; ++i) {
    const double height = 0.01 * (kWithin - distance);
    const dvec3 corners[3] = {{0.1, 0.1, height}, {0.4, 0.1, 0}, {0.1, 0.4, 0}};
    const double before = distance;
    distance = faces_of(mesh, distance).bound(corners, kWithin, nullptr).distance;
    ASSERT_GE(distance, before + height) << i;
    ASSERT_LE(distance, before + height * (1 + 1e-9) + 1e-10 * kWithin) << i;
  }
}

TEST(ReplacedFaces, NeverBoundByLessThanTheDistance) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  int bounded = 0;
  for (int i = 0; i < 3'000; ++i) {
    const double distance = 0.3 * (1 + unit(engine)) * kWithin, scale = std::pow(10, 2 * unit(engine) - 3);
    const TriangleMesh mesh = shapes::fan(5, scale * kWithin * unit(engine));
    dvec3 corners[3];
    for (dvec3& p : corners) p = {0.6 * unit(engine), 0.6 * unit(engine), scale * kWithin * unit(engine)};
    const double bound = faces_of(mesh, distance).bound(corners, kWithin, nullptr).distance;
    if (!(bound <= kWithin)) continue;
    ++bounded;
    const TriangleMesh face{{corners[0], corners[1], corners[2]}, {{0, 1, 2}}};
    EXPECT_LE(distance + hausdorff(face, mesh, {bound - distance, 1, nullptr}).upper, bound * (1 + 1e-12));
  }
  EXPECT_GT(bounded, 300);
  EXPECT_LT(bounded, 2'900);
}

TEST(ReplacedFaces, LeaveOpenWhatTheyCannotBound) {
  const dvec3 inside[3] = {{0.1, 0.1, 0}, {0.4, 0.1, 0}, {0.1, 0.4, 0}},
              beyond[3] = {{0, 0, 0}, {1.2, 0, 0}, {0, 1, 0}};
  EXPECT_LE(faces_of(shapes::fan(6, 0), 0).bound(inside, kWithin, nullptr).distance, kWithin);
  EXPECT_GT(faces_of(shapes::fan(6, 0), 0).bound(beyond, kWithin, nullptr).distance, kWithin);
  EXPECT_GT(faces_of(shapes::fan(6, 0), kWithin).bound(inside, kWithin, nullptr).distance, kWithin)
      << "no room is left";
  EXPECT_GT(
      faces_of(shapes::fan(6, 0), std::numeric_limits<double>::infinity()).bound(inside, kWithin, nullptr).distance,
      kWithin);
  EXPECT_GT(ReplacedFaces().bound(inside, kWithin, nullptr).distance, kWithin);
  constexpr double kTiny = 1e-12;
  EXPECT_GT(faces_of(shapes::fan(6, 0), 0).bound(inside, kTiny, nullptr).distance, kTiny)
      << "a step of it is no more than rounding hides";
}

}  // namespace
