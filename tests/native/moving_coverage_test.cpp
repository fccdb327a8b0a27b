// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/moving_coverage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "check/tolerance_volume.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kTolerance = 0.1;
/// The vertex of needle() that is its tip.
constexpr std::uint32_t kTip = 3;

/// A thin pyramid. Its tip may slide down inside without leaving the volume, so that only the backward direction
/// holds it.
TriangleMesh needle() {
  return {{{0.03, 0, 0}, {-0.02, 0.03, 0}, {-0.02, -0.03, 0}, {0, 0, 1}}, {{0, 1, kTip}, {1, 2, kTip}, {2, 0, kTip}}};
}

/// A mesh over its own reference, moved vertex by vertex.
struct Scene {
  explicit Scene(TriangleMesh reference, std::vector<std::uint32_t> faces = {}, int corners = 3)
      : mesh(std::move(reference)), indices(std::move(faces)) {
    if (indices.empty()) indices = shapes::indices(mesh);
    volume = std::make_unique<ToleranceVolume>(mesh.vertices, mesh.triangles, space, kTolerance);
    moving = std::make_unique<MovingMesh>(*volume, space, indices, corners, mesh.vertices.size(), 1);
    moving->start(mesh.vertices, 180, {}, nullptr);
    coverage = std::make_unique<MovingCoverage>(*moving, nullptr);
  }

  /// Returns the faces that the reference would lose if the vertex moved by this.
  std::vector<std::uint32_t> tried(std::uint32_t vertex, const dvec3& motion) {
    wish = mesh.vertices[vertex] + motion;
    moving->try_all(std::vector{vertex}, std::vector{mesh.vertices[vertex]}, std::vector{wish});
    return coverage->failing(moving->faces_around(std::vector{vertex}));
  }
  void accept(std::uint32_t vertex) {
    const std::vector<std::uint32_t> faces = moving->faces_around(std::vector{vertex});
    coverage->accept(faces);
    moving->accept(std::vector{vertex}, faces);
    mesh.vertices[vertex] = wish;
  }

  StoredSpace space{glm::dmat4(1), Storage::float64};
  TriangleMesh mesh;
  std::vector<std::uint32_t> indices;
  std::unique_ptr<ToleranceVolume> volume;
  std::unique_ptr<MovingMesh> moving;
  std::unique_ptr<MovingCoverage> coverage;
  dvec3 wish{0};
};

TEST(MovingCoverage, ATipMayGoDownByTheToleranceAndNoFurther) {
  Scene scene(needle());
  EXPECT_EQ(scene.coverage->uncovered().faces, 0u);
  EXPECT_TRUE(scene.tried(kTip, {0, 0, -0.095}).empty());
  EXPECT_FALSE(scene.tried(kTip, {0, 0, -0.105}).empty());
  EXPECT_TRUE(scene.tried(kTip, {0, 0, -0.095}).empty()) << "a trial must change nothing";
}

/// How often the first look at a mesh polls whose vertices are up to two tolerances from their places in the reference.
std::size_t polls_from_afar(const TriangleMesh& reference) {
  shapes::Random random(1);
  TriangleMesh moved = reference;
  for (dvec3& p : moved.vertices) p += 2 * kTolerance * random.point();
  const StoredSpace space{glm::dmat4(1), Storage::float64};
  const ToleranceVolume volume(reference.vertices, reference.triangles, space, kTolerance);
  const std::vector<std::uint32_t> faces = shapes::indices(moved);
  MovingMesh moving(volume, space, faces, 3, moved.vertices.size(), 1);
  moving.start(moved.vertices, 180, {}, nullptr);
  return polls_of([&] {
    const MovingCoverage coverage(moving, nullptr);
    EXPECT_GT(coverage.uncovered().faces, reference.triangles.size() / 2);
  });
}

// Beyond the tolerance there is no witness, however small the parts are.
TEST(MovingCoverage, AStartFarFromTheReferenceTakesFewPartsOfATriangle) {
  const TriangleMesh reference = shapes::squares(30, [](const dvec3& p) { return 20.0 * p; });
  EXPECT_LT(polls_from_afar(reference), 220 * reference.triangles.size());
}

// Each search near the hub visits all needles.
TEST(MovingCoverage, AFanOfNeedlesFarFromTheReferenceTakesFewSearches) {
  constexpr unsigned kNeedles = 400;
  TriangleMesh fan{{dvec3(0)}, {}};
  for (unsigned i = 0; i < kNeedles; ++i) {
    const double angle = 0.01 * i / kNeedles;
    fan.vertices.push_back(40.0 * dvec3(std::cos(angle), std::sin(angle), 0));
    if (i > 0) fan.triangles.emplace_back(0, i, i + 1);
  }
  EXPECT_LT(polls_from_afar(fan), 80 * fan.triangles.size());
}

TEST(MovingCoverage, StepsAddUp) {
  Scene scene(needle());
  for (int step = 0; step < 9; ++step) {
    ASSERT_TRUE(scene.tried(kTip, {0, 0, -0.01}).empty()) << step;
    scene.accept(kTip);
  }
  EXPECT_FALSE(scene.tried(kTip, {0, 0, -0.02}).empty());
  EXPECT_TRUE(scene.tried(kTip, {0, 0, 0.09}).empty());
}

TEST(MovingCoverage, APieceGoesToAnotherFaceThatIsNearEnough) {
  // The middle of a plate moves along it by five tolerances: every part of the plate is then covered by another face.
  TriangleMesh plate{{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 0}},
                     {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}};
  Scene scene(plate);
  EXPECT_TRUE(scene.tried(4, {0.5, 0.3, 0}).empty());
  scene.accept(4);
  EXPECT_TRUE(scene.tried(4, {-0.9, -0.7, 0}).empty());
  scene.accept(4);
  EXPECT_FALSE(scene.tried(0, {0.5, 0.5, 0}).empty()) << "nothing else covers the corner of the plate";
}

TEST(MovingCoverage, AQuadCoversTheReferenceInBothTriangulations) {
  const std::vector<std::uint32_t> quad{0, 1, 2, 3};
  const auto roof = [](double height) {
    return TriangleMesh{{{0, 0, height}, {1, 0, 0}, {1, 1, height}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  };
  EXPECT_EQ(Scene(roof(0.05), quad, 4).coverage->uncovered().faces, 0u);
  Scene steep(roof(0.5), quad, 4);
  EXPECT_EQ(steep.coverage->uncovered().faces, 2u);
  EXPECT_EQ(steep.coverage->uncovered().first, 0u);
}

TEST(MovingCoverage, WhatIsNearestToAnUncoveredPartNeverMoves) {
  // The mesh has one side of the pyramid alone.
  Scene scene(needle(), {0, 1, kTip});
  TriangleMesh wide = needle();
  for (dvec3& v : wide.vertices) v.x *= 10, v.y *= 10;
  EXPECT_EQ(scene.coverage->uncovered().faces, 0u) << "the needle is thinner than the tolerance";
  Scene part(wide, {0, 1, kTip});
  EXPECT_EQ(part.coverage->uncovered().faces, 2u);
  EXPECT_EQ(part.coverage->uncovered().first, 1u);
  for (const std::uint32_t v : {0u, 1u, kTip}) EXPECT_TRUE(part.moving->frozen(v));
}

}  // namespace
