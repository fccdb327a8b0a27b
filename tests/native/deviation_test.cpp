// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/deviation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "reference/errors.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// The square [0, 1]^2 at height z, from n x n squares.
TriangleMesh plate(unsigned n, double z, double slope = 0) {
  return shapes::squares(n, [&](const dvec3& p) { return dvec3(p.x, p.y, z + slope * p.x); });
}

TEST(Deviation, ParallelPlates) {
  const double bounds[] = {0.2, 0.3};
  for (const auto& [n, m] : {std::pair{1u, 30u}, {30u, 1u}}) {
    const Deviation d = deviation(plate(n, 0), plate(m, 0.25), bounds);
    EXPECT_NEAR(d.mean, 0.25, 1e-14);
    EXPECT_NEAR(d.rms, 0.25, 1e-14);
    EXPECT_NEAR(d.share_beyond[0], 1, 1e-12);
    EXPECT_EQ(d.share_beyond[1], 0);
    EXPECT_NEAR(d.samples, 262144, 20000);
    EXPECT_NEAR(d.spacing, std::sqrt(1.0 / double(d.samples)), 1e-12);
  }
}

// Distance x over [0, 1]: mean 1/2, rms 1/sqrt 3, share beyond t is 1 - t.
TEST(Deviation, LinearDistance) {
  const TriangleMesh floor{{{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const double bounds[] = {0.1, 0.5, 0.9};
  const Deviation d = deviation(plate(3, 0, 1), floor, bounds);
  EXPECT_NEAR(d.mean, 0.5, 1e-6);
  EXPECT_NEAR(d.rms, std::sqrt(1 / 3.0), 1e-5);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(d.share_beyond[i], 1 - bounds[i], 2 * d.spacing);
}

// By area, not by triangles: half of the area in two triangles, the other half in two thousand.
TEST(Deviation, WeightedByArea) {
  TriangleMesh mesh = plate(1, 1);
  const TriangleMesh fine = plate(32, 3);
  const auto shift = unsigned(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), fine.vertices.begin(), fine.vertices.end());
  for (const glm::uvec3& t : fine.triangles) mesh.triangles.push_back(t + glm::uvec3(shift));
  const double bounds[] = {2};
  const Deviation d = deviation(mesh, plate(1, 0), bounds);
  EXPECT_NEAR(d.mean, 2, 1e-12);
  EXPECT_NEAR(d.rms, std::sqrt(5), 1e-12);
  EXPECT_NEAR(d.share_beyond[0], 0.5, 1e-12);
}

TEST(Deviation, EveryTriangleHasASample) {
  TriangleMesh mesh = plate(1, 0);
  for (unsigned i = 0; i < 300; ++i) {
    mesh.vertices.insert(mesh.vertices.end(), {{0, 0, 5}, {1e-3, 0, 5}, {0, 1e-3, 5}});
    mesh.triangles.push_back(glm::uvec3(4 + 3 * i) + glm::uvec3(0, 1, 2));
  }
  const double bounds[] = {4};
  const Deviation d = deviation(mesh, plate(1, 0), bounds);
  EXPECT_NEAR(d.share_beyond[0], 300 * 0.5e-6 / (1 + 300 * 0.5e-6), 1e-12);
}

TEST(Deviation, WithoutArea) {
  const TriangleMesh floor = plate(4, 0);
  // Two segments of length 1 and 3, at heights 1 and 2.
  const TriangleMesh segments{{{0, 0, 1}, {1, 0, 1}, {0, 0, 2}, {0, 3, 2}, {0, 1, 2}}, {{0, 1, 0}, {2, 4, 3}}};
  const double bounds[] = {1.5};
  const Deviation lines = deviation(segments, floor, bounds);
  EXPECT_NEAR(lines.share_beyond[0], 0.75, 1e-12);
  // Beyond the plate the distance of the second one is sqrt(4 + (y - 1)^2), 1 <= y <= 3.
  const double slanted = 2 * std::sqrt(2.0) + 2 * std::asinh(1.0);
  EXPECT_NEAR(lines.mean, (1 * 1 + 1 * 2 + slanted) / 4, 1e-6);
  EXPECT_GT(lines.spacing, 0);
  const TriangleMesh points{{{0.5, 0.5, 1}, {0.5, 0.5, 3}}, {{0, 0, 0}, {1, 1, 1}}};
  const Deviation dots = deviation(points, floor, bounds);
  EXPECT_DOUBLE_EQ(dots.mean, 2);
  EXPECT_DOUBLE_EQ(dots.rms, std::sqrt(5));
  EXPECT_DOUBLE_EQ(dots.share_beyond[0], 0.5);
  EXPECT_EQ(dots.spacing, 0);
  EXPECT_EQ(dots.samples, 2u);
  EXPECT_DOUBLE_EQ(deviation(floor, points).share_beyond.size(), 0);
  const TriangleMesh point{{{7, 7, 7}}, {{0, 0, 0}}};
  EXPECT_EQ(deviation(point, point).mean, 0);
}

TEST(Deviation, AnyScaleAndAnyPlace) {
  for (const auto& [scale, offset] : {std::pair{1e-300, 0.0}, {1e-20, 0.0}, {1e20, 0.0}, {1e300, 0.0}, {1.0, 1e6}}) {
    TriangleMesh a = plate(5, 0), b = plate(3, 0.25);
    for (TriangleMesh* mesh : {&a, &b}) {
      for (dvec3& p : mesh->vertices) p = offset * dvec3(1, -1, 2) + scale * p;
    }
    const double bounds[] = {0.24 * scale, 0.26 * scale};
    const Deviation d = deviation(a, b, bounds);
    EXPECT_NEAR(d.mean / scale, 0.25, 1e-9);
    EXPECT_NEAR(d.rms / scale, 0.25, 1e-9);
    EXPECT_NEAR(d.share_beyond[0], 1, 1e-12);
    EXPECT_EQ(d.share_beyond[1], 0);
    EXPECT_NEAR(d.spacing / scale, 1 / 512.0, 1e-4);
  }
}

TEST(Deviation, SameForAnyNumberOfThreads) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 0.01);
  TriangleMesh rough = plate(120, 0);
  for (dvec3& p : rough.vertices) p.z += normal(random);
  const double bounds[] = {0.01};
  const Deviation one = deviation(rough, plate(3, 0), bounds, {1, nullptr});
  for (const unsigned threads : {2u, 5u}) {
    const Deviation many = deviation(rough, plate(3, 0), bounds, {threads, nullptr});
    EXPECT_EQ(many.mean, one.mean);
    EXPECT_EQ(many.rms, one.rms);
    EXPECT_EQ(many.share_beyond, one.share_beyond);
  }
}

TEST(Deviation, BadInputProgressAndCancel) {
  const TriangleMesh good = plate(2, 0);
  const double bounds[] = {1, std::nan("")};
  EXPECT_THROW(deviation(good, good, bounds), InvalidInput);
  EXPECT_THROW(deviation({}, good), InvalidInput);
  EXPECT_THROW(deviation(good, {{{0, 0, std::nan("")}}, {{0, 0, 0}}}), InvalidInput);
  Progress progress;
  deviation(good, good, {}, {1, &progress});
  EXPECT_STREQ(progress.stage(), "averaging");
  EXPECT_EQ(progress.fraction(), 1);
  progress.cancel();
  EXPECT_THROW(deviation(good, good, {}, {1, &progress}), Cancelled);
}

}  // namespace
