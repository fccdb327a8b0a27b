// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes of slivers and of fans: the counts they come down to, and what that costs, counted in polls.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "check/certificate.h"
#include "decimation_cases.h"
#include "many.h"
#include "polls.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::Options;
using cases::run;
using glm::dvec3;

/// A flat fan around its middle, whose rim has the radii 1 and 0.05 in turn.
Case star(unsigned rim) {
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, 0);
  for (unsigned i = 0; i < rim; ++i) {
    const double angle = 2 * std::numbers::pi * i / rim, radius = i % 2 == 0 ? 1 : 0.05;
    mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
    mesh.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % rim);
  }
  return {shapes::stored(mesh)};
}

/// A closed cylinder of radius 1 and height 2: two fans, and a strip of slivers between them.
Case cylinder(unsigned sides, double percent) {
  TriangleMesh mesh;
  for (const double z : {0.0, 2.0}) {
    for (unsigned i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), z);
    }
  }
  mesh.vertices.emplace_back(0, 0, 0), mesh.vertices.emplace_back(0, 0, 2);
  for (unsigned i = 0; i < sides; ++i) {
    const unsigned j = (i + 1) % sides;
    mesh.triangles.emplace_back(i, j, sides + j), mesh.triangles.emplace_back(i, sides + j, sides + i);
    mesh.triangles.emplace_back(2 * sides, j, i), mesh.triangles.emplace_back(2 * sides + 1, sides + i, sides + j);
  }
  return {shapes::stored(mesh), glm::dmat4(1), Storage::float32, percent};
}

Options alone() {
  Options options;
  options.threads = 1;
  return options;
}

TEST(Slivers, AFaceAcrossSliversIsProvedInFewParts) {
  const Case c = cylinder(1500, 0.05);
  const auto volume = c.volume();
  const StoredSpace placed = c.space().in(volume->frame());
  // A long face over six pairs of slivers, at an angle to them.
  const auto at = [](double degrees, double z) {
    const double angle = degrees * std::numbers::pi / 180;
    return dvec3(std::cos(angle), std::sin(angle), z);
  };
  const dvec3 corners[3] = {placed.frame(at(0.5, 2)), placed.frame(at(1.6, 1.9996)), placed.frame(at(1.1, 0))};
  const TriangleCertificate certificate(volume->witnesses(), volume->grid(), volume->hierarchy(),
                                        volume->provable(placed.mapping_error(c.mesh.vertices)), volume->refutable(0));
  const dvec3 unknown(std::numeric_limits<double>::infinity());
  double bound = 0;
  // One poll is 256 parts.
  EXPECT_LE(polls_of([&] { bound = certificate.bound({corners[0], corners[1], corners[2]}, unknown); }), 2u);
  EXPECT_NE(bound, TriangleCertificate::kUnproved);
}

TEST(Slivers, ACylinderEndsNearItsOptimum) {
  // With both sides of the tolerance in use 42 sides would do: 168 triangles.
  for (const unsigned sides : {across(400), across(800)}) {
    const Case c = cylinder(sides, 0.05);
    const DecimationResult r = run(c, alone());
    cases::expect_within(c, r);
    EXPECT_LE(r.triangles.size(), 240u) << sides;
    Options subset = alone();
    subset.placement = Options::Placement::subset;
    EXPECT_LE(static_cast<double>(r.triangles.size()), 1.02 * static_cast<double>(run(c, subset).triangles.size()));
  }
}

TEST(Slivers, AStarIsFilled) {
  const Case c = star(800);
  const DecimationResult r = run(c, alone());
  cases::expect_within(c, r);
  EXPECT_LE(r.triangles.size(), 40u);
}

// The quadric's best position between two tips costs next to nothing, and is refused.
TEST(Slivers, AStarIsFilledFromTheTipsOfItsRays) {
  Case c = star(2500);
  c.percent = 0.16;
  const DecimationResult r = run(c, alone());
  cases::expect_within(c, r);
  EXPECT_LE(r.triangles.size(), 50u);
}

TEST(Slivers, TheWorkAtAFanGrowsHardlyFasterThanItsFaces) {
  std::size_t before = 0;
  for (const unsigned rim : {across(500), across(1000), across(2000)}) {
    const Case c = star(rim);
    const auto volume = c.volume();
    const std::size_t polls =
        polls_of([&] { decimate(c.mesh.vertices, c.mesh.triangles, c.space(), volume.get(), alone()); });
    if (before > 0) {
      EXPECT_LE(polls, 3 * before) << rim;
    }
    before = polls;
  }
}

TEST(Slivers, ThreadsTryLittleInVainAroundAVertexWithManyFaces) {
  // Every change around the apex of a cone is in the space of every other.
  TriangleMesh cone;
  constexpr unsigned kSides = 1500;
  cone.vertices.emplace_back(0, 0, 0.5);
  for (unsigned i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    cone.vertices.emplace_back(std::cos(angle), std::sin(angle), i % 2 == 0 ? 0 : 0.05);
    cone.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % kSides);
  }
  const Case c{shapes::stored(cone)};
  const auto volume = c.volume();
  const auto polls = [&](unsigned threads) {
    Options options;
    options.threads = threads;
    return polls_of([&] { decimate(c.mesh.vertices, c.mesh.triangles, c.space(), volume.get(), options); });
  };
  const std::size_t one = polls(1), two = polls(2);
  EXPECT_LE(two, 3 * one);
}

}  // namespace
