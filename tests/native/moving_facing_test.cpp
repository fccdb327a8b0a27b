// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/moving_facing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "base/parallel.h"
#include "check/certificate.h"
#include "motion/constrain.h"
#include "motion/guard.h"
#include "shapes.h"

namespace tolvol {
namespace {

using glm::dvec3;
using Points = std::vector<dvec3>;

const StoredSpace kStored(glm::dmat4(1), Storage::float64);

/// A square plate of four triangles around its middle.
const TriangleMesh kPlate{{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 0}},
                          {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}};
const std::vector<std::uint32_t> kFaces{0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4};

TEST(MovingFacing, AVertexStopsWhereItsFacesWouldTurnOver) {
  const ToleranceVolume volume(kPlate.vertices, kPlate.triangles, kStored, 1);
  Points wish = kPlate.vertices;
  wish[4] = {1.5, 0, 0};
  ConstrainOptions options;
  options.two_sided = false, options.crossings = PullBack::Crossings::allow;
  const ConstrainResult kept = constrain(kPlate.vertices, wish, kFaces, 3, kStored, volume, options);
  EXPECT_GT(kept.vertices[4].x, 0.9);
  EXPECT_LT(kept.vertices[4].x, 1);
  EXPECT_LE(kept.normals->largest.value(), 90);
  options.max_normal_angle = 180;
  const ConstrainResult free = constrain(kPlate.vertices, wish, kFaces, 3, kStored, volume, options);
  EXPECT_EQ(free.vertices, wish);
  EXPECT_FALSE(free.normals);
}

TEST(MovingFacing, AnAngleOfOnesOwnIsReachedAndNotPassed) {
  const ToleranceVolume volume(kPlate.vertices, kPlate.triangles, kStored, 2);
  Points wish = kPlate.vertices;
  wish[4] = {0, 0, 1.5};
  for (const double angle : {5.0, 30.0, 50.0}) {
    ConstrainOptions options;
    options.two_sided = false, options.max_normal_angle = angle;
    const ConstrainResult kept = constrain(kPlate.vertices, wish, kFaces, 3, kStored, volume, options);
    // The faces rise from the rim, which is 1 away from the middle.
    const double height = std::tan(glm::radians(angle));
    EXPECT_LE(kept.vertices[4].z, height);
    EXPECT_GT(kept.vertices[4].z, height - 0.05);
    EXPECT_NEAR(kept.normals->largest.value(), glm::degrees(std::atan(kept.vertices[4].z)), 0.1);
  }
}

/// The exact angle between two triangles, but for rounding.
double angle_between(const dvec3 (&a)[3], const dvec3 (&b)[3]) {
  const dvec3 n = glm::normalize(glm::cross(a[1] - a[0], a[2] - a[0]));
  const dvec3 m = glm::normalize(glm::cross(b[1] - b[0], b[2] - b[0]));
  return std::atan2(glm::length(glm::cross(n, m)), glm::dot(n, m));
}

TEST(MovingFacing, NoMotionWithinTheRoomExceedsTheAngle) {
  std::mt19937 engine(1);
  std::normal_distribution<double> normal;
  const auto random = [&] { return dvec3(normal(engine), normal(engine), normal(engine)); };
  double largest_share = 0;
  Team alone(1);
  for (int shape = 0; shape < 2000; ++shape) {
    dvec3 at[3] = {0.1 * random(), 0.1 * random(), 0.1 * random()};
    if (shape % 2) at[2] = 0.5 * (at[0] + at[1]) + 0.1 * (at[2] - at[0]);  // slivers as well
    const double limit = std::uniform_real_distribution(0.1, 3.0)(engine);
    MovingFacing facing(FacingRule({{at[0], at[1], at[2]}, {{0, 1, 2}}}, 0, 0, limit, alone), 1, 3);
    facing.of(0, 0).limit = limit;
    facing.start_own(0, 0, at, sure_normal(at[0], at[1], at[2], 0));
    for (int turn = 0; turn < 20; ++turn) {
      dvec3 moved[3];
      for (int k = 0; k < 3; ++k) moved[k] = at[k] + facing.room(0) * glm::normalize(random());
      const double angle = angle_between(at, moved);
      EXPECT_LE(angle, limit);
      largest_share = std::max(largest_share, angle / limit);
      double room = std::numeric_limits<double>::infinity();
      facing.follow(0, 0, moved, room);
      EXPECT_GE(room, 0);
    }
  }
  EXPECT_GT(largest_share, 0.5) << "the room is not much smaller than it has to be";
}

TEST(MovingFacing, WhatTurnsTooFarHasNoRoom) {
  const dvec3 at[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, over[3] = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}};
  Team alone(1);
  MovingFacing facing(FacingRule({{at[0], at[1], at[2]}, {{0, 1, 2}}}, 0, 0, std::numbers::pi / 2, alone), 1, 3);
  facing.of(0, 0).limit = std::numbers::pi / 2;
  facing.start_own(0, 0, at, sure_normal(at[0], at[1], at[2], 0));
  double room = 1;
  facing.follow(0, 0, over, room);
  EXPECT_LT(room, 0);
  facing.of(0, 0).limit = std::numbers::pi;  // free of the rule
  room = 1;
  facing.follow(0, 0, over, room);
  EXPECT_EQ(room, 1);
}

}  // namespace
}  // namespace tolvol
