// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/deviation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "base/errors.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// The square [0, 1]^2 at height z, from n x n squares.
TriangleMesh plate(unsigned n, double z, double slope = 0) {
  return shapes::squares(n, [&](const dvec3& p) { return dvec3(p.x, p.y, z + slope * p.x); });
}

/// Pieces enough for tests in which their number is not the point.
constexpr std::size_t kSome = 24576;

TEST(Deviation, ParallelPlates) {
  const double bounds[] = {0.2, 0.3};
  for (const auto& [n, m] : {std::pair{1u, 30u}, {30u, 1u}}) {
    const double percentiles[] = {0, 50, 100};
    const Deviation d = deviation(plate(n, 0), plate(m, 0.25), {bounds, percentiles});
    for (const Estimate& e : {d.mean, d.rms, d.percentiles[0], d.percentiles[1], d.percentiles[2]}) {
      EXPECT_NEAR(e.value, 0.25, 1e-14);
      EXPECT_NEAR(e.range.lower, 0.25, 1e-14);
      EXPECT_NEAR(e.range.upper, 0.25, 1e-4);
    }
    EXPECT_NEAR(d.share_beyond[0].range.lower, 1, 1e-12);
    EXPECT_EQ(d.share_beyond[1].range.upper, 0);
    EXPECT_NEAR(d.distances.size(), 196608, 30000);
    EXPECT_NEAR(d.spacing, std::sqrt(1.0 / double(d.distances.size())), 1e-12);
  }
}

/// Whether the truth is in the range, and the estimate near it.
void expect(const Estimate& e, double truth, double error, const char* what = "") {
  EXPECT_LE(e.range.lower, truth + 1e-12) << what;
  EXPECT_GE(e.range.upper, truth - 1e-12) << what;
  EXPECT_NEAR(e.value, truth, error) << what;
  EXPECT_LE(e.range.lower, e.value) << what;
  EXPECT_GE(e.range.upper, e.value) << what;
}

// Where all distances are rounding, and where many shares of the area are equal, the ends of a range do not change
// places.
TEST(Deviation, EveryRangeIsInOrder) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal(0, 1);
  const double bounds[] = {0, 1e-17, 0.25, 1}, percentiles[] = {0, 1, 25, 100.0 / 3, 50, 200.0 / 3, 75, 99, 100};
  // Twelve rounds have each of the meshes with each of the moves.
  for (int round = 0; round < 12; ++round) {
    TriangleMesh mesh = round % 3 == 0 ? shapes::box(2) : TriangleMesh{};
    for (int i = 0; i < (round % 2 ? 1 : 3) && round % 3 != 0; ++i) {
      const unsigned first = unsigned(mesh.vertices.size());
      for (int k = 0; k < 3; ++k) mesh.vertices.emplace_back(normal(random), normal(random), normal(random));
      mesh.triangles.push_back(glm::uvec3(first) + glm::uvec3(0, 2, 1));
    }
    TriangleMesh moved = mesh;
    for (dvec3& p : moved.vertices) p += round % 4 < 2 ? dvec3(0) : dvec3(0.25, 0, round % 4 == 2 ? 0 : 1e-16);
    const Deviation d = deviation(mesh, moved, {.bounds = bounds, .percentiles = percentiles, .pieces = kSome});
    std::vector<Estimate> all{d.mean, d.rms};
    all.insert(all.end(), d.share_beyond.begin(), d.share_beyond.end());
    all.insert(all.end(), d.percentiles.begin(), d.percentiles.end());
    if (d.sides) {
      all.insert(all.end(), {d.sides->mean, d.sides->share_inside});
      for (const Range& range : {d.sides->inside, d.sides->outside}) all.push_back({range.lower, range});
    }
    for (const Estimate& e : all) {
      EXPECT_LE(e.range.lower, e.value) << round;
      EXPECT_LE(e.value, e.range.upper) << round;
    }
  }
}

// Distance x over [0, 1]: mean 1/2, rms 1/sqrt 3, share beyond t is 1 - t, the p-th percentile is p.
TEST(Deviation, LinearDistance) {
  const TriangleMesh floor{{{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const double bounds[] = {0.1, 0.5, 0.9}, percentiles[] = {10, 50, 99.9};
  const Deviation d = deviation(plate(3, 0, 1), floor, {bounds, percentiles});
  expect(d.mean, 0.5, 2 * d.mean_error);
  EXPECT_LT(d.mean_error, 2e-5);
  EXPECT_LT(d.mean.range.upper - d.mean.range.lower, 1e-6);
  expect(d.rms, std::sqrt(1 / 3.0), 1e-4);
  for (int i = 0; i < 3; ++i) {
    expect(d.share_beyond[i], 1 - bounds[i], 1e-3);
    expect(d.percentiles[i], percentiles[i] / 100, 1e-3);
    EXPECT_LT(d.percentiles[i].range.upper - d.percentiles[i].range.lower, 4 * d.spacing);
  }
}

// A fold of the distance in every square of b, and squares smaller than the pieces of a: |x - nearest k / 300|.
TEST(Deviation, FoldsBetweenTheSamples) {
  const unsigned n = 300;
  TriangleMesh walls;  // b: planes x = k / n, so that the distance from z = 0 within is that to the nearest
  for (unsigned i = 0; i <= n; ++i) {
    const unsigned first = unsigned(walls.vertices.size());
    const double x = i / double(n);
    walls.vertices.insert(walls.vertices.end(), {{x, -1, -1}, {x, 5, -1}, {x, -1, 5}});
    walls.triangles.push_back(glm::uvec3(first) + glm::uvec3(0, 1, 2));
  }
  const double percentiles[] = {25, 50, 75, 95};
  const Deviation d = deviation(plate(1, 0), walls, {{}, percentiles});
  const double largest = 0.5 / n;
  EXPECT_GT(d.spacing, 0.2 * largest);  // or else the case is none
  expect(d.mean, largest / 2, 0.001 * largest);
  expect(d.rms, largest / std::sqrt(3), 0.001 * largest);
  for (int i = 0; i < 4; ++i) expect(d.percentiles[i], percentiles[i] / 100 * largest, 0.005 * largest);
}

// In the middle of a torus everything is as near as everything else; the piece is short, or as long as that is far.
TEST(Deviation, ManyTrianglesAlikeFar) {
  const TriangleMesh outer = shapes::torus(40);
  for (const double length : {1e-3, 0.5}) {
    if (kSanitized && length < 0.5) continue;
    const TriangleMesh disc{{{0, 0, 0}, {length, 0, 0}, {0, length, 0}}, {{0, 1, 2}}};
    const Deviation d = deviation(disc, outer, {.pieces = kSome});
    // The distance from the inner ring, 0.6 - |x|, but for its 40 corners: the sides sag by 0.3 %.
    const double mean = 0.6 - length * (std::sqrt(2) + std::asinh(1)) / (3 * std::sqrt(2));
    EXPECT_NEAR(d.mean.value, mean, 2e-3);
    EXPECT_LE(d.mean.range.lower, d.mean.value);
    EXPECT_GE(d.mean.range.upper, d.mean.value);
    EXPECT_LT(d.mean.range.upper - d.mean.range.lower, 1e-3 * 0.6);
  }
}

TEST(Deviation, RefinedUntilTheMeanIsKnown) {
  // Noise that four pieces a square see badly, and 16 well.
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 0.01);
  TriangleMesh rough = plate(40, 0);
  for (dvec3& p : rough.vertices) p.z += normal(random);
  for (const auto& [a, b] : {std::pair{rough, plate(3, 0)}, {plate(3, 0), rough}}) {
    const Deviation d = deviation(a, b);
    const double largest = *std::max_element(d.distances.begin(), d.distances.end());
    const double width = d.mean.range.upper - d.mean.range.lower;
    EXPECT_TRUE(width <= 0.001 * largest || d.distances.size() > 225000) << width / largest;
    EXPECT_LE(d.distances.size(), 229376u);
    EXPECT_LT(width, 0.02 * largest);
  }
}

TEST(Deviation, SignedWhereTheReferenceIsClosed) {
  TriangleMesh box = shapes::box(3);
  // The square [0, 1] x [0.5, 1.5] at z = 0.25: half inside, up to 0.25 deep; half outside, up to 0.5.
  const TriangleMesh plate = shapes::squares(4, [](const dvec3& p) { return p + dvec3(0, 0.5, 0.25); });
  const double deepest = 0.25, mean_outside = 0.25;
  double mean_inside = 0;
  const int n = 400;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double x = (i + 0.5) / n, y = 0.5 + (j + 0.5) / (2 * n);
      mean_inside += std::min({x, 1 - x, 1 - y, 0.25}) / n / n;
    }
  }
  for (const bool inside_out : {false, true}) {
    if (inside_out) {
      for (glm::uvec3& t : box.triangles) std::swap(t.x, t.y);
    }
    const Deviation d = deviation(plate, box);
    ASSERT_TRUE(d.sides.has_value());
    expect(d.sides->share_inside, 0.5, 1e-3);
    expect(d.sides->mean, (mean_outside - mean_inside) / 2, 1e-4);
    EXPECT_LE(d.sides->inside.lower, deepest + 1e-12);
    EXPECT_GE(d.sides->inside.upper, deepest);
    EXPECT_NEAR(d.sides->inside.lower, deepest, 1e-3);
    EXPECT_LE(d.sides->outside.lower, 0.5);
    EXPECT_GE(d.sides->outside.upper, 0.5);
    EXPECT_NEAR(d.sides->outside.upper, 0.5, 1e-2);
    EXPECT_NEAR(*std::min_element(d.distances.begin(), d.distances.end()), -deepest, 1e-3);
    EXPECT_NEAR(*std::max_element(d.distances.begin(), d.distances.end()), 0.5, 1e-2);
  }
  box.triangles.pop_back();
  EXPECT_FALSE(deviation(plate, box).sides.has_value());
}

// A corner of a closed mesh that lies far away costs no steps, widens no range, and leaves the sides as they are.
TEST(Deviation, FarCornersCostNothing) {
  TriangleMesh torus = shapes::torus(30);
  TriangleMesh moved = torus;
  for (dvec3& p : moved.vertices) p += dvec3(0.05, 0.02, 0.1);
  const auto to_far = [&](double far) {
    TriangleMesh target = torus;
    target.vertices[7] = far * dvec3(1, 0.3, 1);
    return deviation(moved, target, {.pieces = kSome});
  };
  const Deviation near = to_far(20), first = to_far(1e4);  // at 20 nothing is cut off
  ASSERT_TRUE(near.sides.has_value());
  EXPECT_NEAR(first.mean.value, near.mean.value, 0.02 * near.mean.value);
  for (const double far : {1e7, 1e14, 1e19, 1e150, 1e300}) {
    if (kSanitized && far != 1e19) continue;
    const Deviation d = to_far(far);
    EXPECT_LE(d.steps, first.steps + first.steps / 100) << far;
    EXPECT_NEAR(d.mean.value, first.mean.value, 0.001 * first.mean.value) << far;
    EXPECT_LE(d.mean.range.upper - d.mean.range.lower, 0.01 * d.mean.value) << far;
    ASSERT_TRUE(d.sides.has_value()) << far;
    EXPECT_NEAR(d.sides->share_inside.value, near.sides->share_inside.value, 0.01) << far;
    EXPECT_NEAR(d.sides->mean.value, near.sides->mean.value, 0.01 * near.mean.value) << far;
  }
  // The whole mesh decides whether it is closed, and which way round its faces run.
  for (const double far : {20.0, 1e19, 1e300}) {
    torus = shapes::turned(shapes::torus(30));
    EXPECT_NEAR(to_far(far).sides->share_inside.value, near.sides->share_inside.value, 0.01) << far;
    torus.triangles.pop_back();
    EXPECT_FALSE(to_far(far).sides.has_value()) << far;
  }
}

// From a mesh with such a corner the other mesh is a point, and all of its triangles are as near.
TEST(Deviation, FarCornersOfTheMeshItselfCostNothing) {
  const TriangleMesh torus = shapes::torus(30);
  TriangleMesh far = torus;
  for (const double at : {1e19, 1e50, 1e100}) {
    far.vertices[7] = at * dvec3(1, 0, 0);
    const Deviation d = deviation(far, torus, {.pieces = kSome});
    EXPECT_LE(d.steps, 40 * d.distances.size()) << at;
    EXPECT_NEAR(d.mean.value / at, 1 / 3.0, 1e-3) << at;  // of triangles with two corners at 0 and one at `at`
    EXPECT_LE(d.mean.range.lower / at, 1 / 3.0);
    EXPECT_GE(d.mean.range.upper / at, 1 / 3.0);
    ASSERT_TRUE(d.sides.has_value());
    EXPECT_LE(d.sides->share_inside.value, 1e-9);
  }
}

TEST(Deviation, HasAsManyPiecesAsAreAskedFor) {
  const double percentiles[] = {50, 100};
  double last = 1;
  for (const std::size_t pieces : {100u, 3000u, 50000u}) {
    const TriangleMesh floor{{{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}}, {{0, 1, 2}, {0, 2, 3}}};
    const Deviation d = deviation(plate(1, 0, 1), floor, {.percentiles = percentiles, .pieces = pieces});
    EXPECT_GT(double(d.distances.size()), 0.9 * double(pieces));
    EXPECT_LT(double(d.distances.size()), 1.2 * double(pieces));
    expect(d.percentiles[0], 0.5, d.spacing);
    expect(d.percentiles[1], 1, d.spacing);
    const double width = d.percentiles[0].range.upper - d.percentiles[0].range.lower;
    EXPECT_LT(width, 0.5 * last);
    last = width;
  }
}

TEST(Deviation, WeightsAddUpToOne) {
  const Deviation d = deviation(shapes::torus(30, 0.01), shapes::torus(20));
  double sum = 0, mean = 0;
  ASSERT_EQ(d.distances.size(), d.weights.size());
  for (std::size_t i = 0; i < d.weights.size(); ++i) {
    sum += d.weights[i];
    mean += d.weights[i] * std::abs(d.distances[i]);
  }
  EXPECT_NEAR(sum, 1, 1e-9);
  EXPECT_NEAR(mean, d.mean.value, 1e-3 * mean);
}

// By area, not by triangles: half of the area in two triangles, the other half in two thousand.
TEST(Deviation, WeightedByArea) {
  TriangleMesh mesh = plate(1, 1);
  const TriangleMesh fine = plate(32, 3);
  const auto shift = unsigned(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), fine.vertices.begin(), fine.vertices.end());
  for (const glm::uvec3& t : fine.triangles) mesh.triangles.push_back(t + glm::uvec3(shift));
  const double bounds[] = {2};
  const Deviation d = deviation(mesh, plate(1, 0), {bounds});
  expect(d.mean, 2, 1e-12);
  expect(d.rms, std::sqrt(5), 1e-12);
  expect(d.share_beyond[0], 0.5, 1e-12);
}

TEST(Deviation, EveryTriangleHasASample) {
  TriangleMesh mesh = plate(1, 0);
  for (unsigned i = 0; i < 300; ++i) {
    mesh.vertices.insert(mesh.vertices.end(), {{0, 0, 5}, {1e-3, 0, 5}, {0, 1e-3, 5}});
    mesh.triangles.push_back(glm::uvec3(4 + 3 * i) + glm::uvec3(0, 1, 2));
  }
  const double bounds[] = {4};
  const Deviation d = deviation(mesh, plate(1, 0), {bounds});
  expect(d.share_beyond[0], 300 * 0.5e-6 / (1 + 300 * 0.5e-6), 1e-12);
}

TEST(Deviation, WithoutArea) {
  const TriangleMesh floor = plate(4, 0);
  // Two segments of length 1 and 3, at heights 1 and 2.
  const TriangleMesh segments{{{0, 0, 1}, {1, 0, 1}, {0, 0, 2}, {0, 3, 2}, {0, 1, 2}}, {{0, 1, 0}, {2, 4, 3}}};
  const double bounds[] = {1.5};
  const Deviation lines = deviation(segments, floor, {bounds});
  expect(lines.share_beyond[0], 0.75, 1e-12);
  // Beyond the plate the distance of the second one is sqrt(4 + (y - 1)^2), 1 <= y <= 3.
  const double slanted = 2 * std::sqrt(2.0) + 2 * std::asinh(1.0);
  expect(lines.mean, (1 * 1 + 1 * 2 + slanted) / 4, 1e-6);
  EXPECT_GT(lines.spacing, 0);
  const TriangleMesh points{{{0.5, 0.5, 1}, {0.5, 0.5, 3}}, {{0, 0, 0}, {1, 1, 1}}};
  const Deviation dots = deviation(points, floor, {bounds});
  expect(dots.mean, 2, 1e-14);
  expect(dots.rms, std::sqrt(5), 1e-14);
  expect(dots.share_beyond[0], 0.5, 1e-14);
  EXPECT_EQ(dots.spacing, 0);
  EXPECT_EQ(dots.distances.size(), 2u);
  EXPECT_EQ(deviation(floor, points).share_beyond.size(), 0u);
  const TriangleMesh point{{{7, 7, 7}}, {{0, 0, 0}}};
  EXPECT_EQ(deviation(point, point).mean.value, 0);
}

TEST(Deviation, AnyScaleAndAnyPlace) {
  for (const auto& [scale, offset] : {std::pair{1e-300, 0.0}, {1e-20, 0.0}, {1e20, 0.0}, {1e300, 0.0}, {1.0, 1e6}}) {
    TriangleMesh a = plate(5, 0), b = plate(3, 0.25);
    for (TriangleMesh* mesh : {&a, &b}) {
      for (dvec3& p : mesh->vertices) p = offset * dvec3(1, -1, 2) + scale * p;
    }
    const double bounds[] = {0.24 * scale, 0.26 * scale};
    const Deviation d = deviation(a, b, {bounds});
    EXPECT_NEAR(d.mean.value / scale, 0.25, 1e-9);
    EXPECT_NEAR(d.rms.value / scale, 0.25, 1e-9);
    EXPECT_NEAR(d.share_beyond[0].value, 1, 1e-12);
    EXPECT_EQ(d.share_beyond[1].value, 0);
    EXPECT_NEAR(d.spacing / scale, std::sqrt(1 / 196608.0), 1e-4);
  }
}

// Between two fans of needles that meet in one point every search looks at a share of all triangles, so that the number
// of pieces says little about the time. What ends early is as true, and wider.
TEST(Deviation, EndsByItsStepsWhereNeedlesCrowd) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0, 1);
  const unsigned n = 206;
  TriangleMesh fan, moved;
  for (unsigned i = 0; i < n; ++i) {
    fan.vertices.emplace_back(std::cos(2 * M_PI * i / n), std::sin(2 * M_PI * i / n), 0);
    fan.triangles.emplace_back(n, i, (i + 1) % n);
  }
  fan.vertices.emplace_back(0, 0, 0);
  moved = fan;
  for (dvec3& p : moved.vertices) p += dvec3(normal(random), normal(random), normal(random));
  const double percentiles[] = {50, 100};
  // There are at most `first` pieces at first, and at most `pieces` in the end.
  const std::size_t wanted = 4 * kSome, pieces = wanted + wanted / 6, first = wanted + 2 * n;
  for (const auto& [a, b] : {std::pair{fan, moved}, {moved, fan}}) {
    Deviation before{};
    const HausdorffInterval largest = hausdorff(a, b);
    for (const double steps : {0.0, 4.0, 16.0}) {
      if (kSanitized && steps > 4) break;
      DeviationOptions options;
      options.percentiles = percentiles, options.steps = steps, options.pieces = wanted;
      const Deviation d = deviation(a, b, options);
      // What is begun ends, and each of the first pieces has a search of its own: of 63 nodes at most, with 206 faces.
      EXPECT_LE(double(d.steps), steps * pieces + 63.0 * first + 4096 * 512);
      EXPECT_LE(d.distances.size(), pieces);
      EXPECT_NEAR(std::accumulate(d.weights.begin(), d.weights.end(), 0.0), 1, 1e-9);
      EXPECT_GE(d.percentiles[1].range.upper, largest.lower - 1e-12);
      EXPECT_LE(d.percentiles[1].range.lower, largest.upper + 1e-12);
      double mean = 0, square = 0;
      for (std::size_t i = 0; i < d.distances.size(); ++i) {
        const double distance = std::abs(d.distances[i]);
        mean += d.weights[i] * distance, square += d.weights[i] * distance * distance;
      }
      EXPECT_NEAR(d.mean.value, mean, 1e-3 * mean);  // the samples alone are a less exact estimate
      EXPECT_NEAR(d.rms.value, std::sqrt(square), 1e-9);
      if (before.steps > 0) {
        EXPECT_GT(d.steps, before.steps);
        EXPECT_NEAR(d.mean.value, before.mean.value, 4 * (d.mean_error + before.mean_error));
        EXPECT_LE(d.mean.range.upper - d.mean.range.lower, before.mean.range.upper - before.mean.range.lower);
        EXPECT_LE(std::max(d.mean.range.lower, before.mean.range.lower),
                  std::min(d.mean.range.upper, before.mean.range.upper));
      }
      options.threads = 3;
      const Deviation again = deviation(a, b, options);
      EXPECT_EQ(again.steps, d.steps);
      EXPECT_EQ(again.distances, d.distances);
      before = d;
    }
    if (kSanitized) break;
  }
}

TEST(Deviation, SameForAnyNumberOfThreads) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 0.01);
  TriangleMesh rough = plate(across(120), 0);
  for (dvec3& p : rough.vertices) p.z += normal(random);
  const double bounds[] = {0.01};
  DeviationOptions options;
  options.bounds = bounds, options.steps = 16, options.threads = 1, options.pieces = kSome;
  const Deviation one = deviation(rough, plate(3, 0), options);
  for (const unsigned threads : {2u, 5u}) {
    options.threads = threads;
    const Deviation many = deviation(rough, plate(3, 0), options);
    EXPECT_EQ(many.mean.value, one.mean.value);
    EXPECT_EQ(many.rms.range.upper, one.rms.range.upper);
    EXPECT_EQ(many.share_beyond[0].value, one.share_beyond[0].value);
    EXPECT_EQ(many.distances, one.distances);
    EXPECT_EQ(many.weights, one.weights);
  }
}

TEST(Deviation, BadInputProgressAndCancel) {
  const TriangleMesh good = plate(2, 0);
  const double bounds[] = {1, std::nan("")};
  EXPECT_THROW(deviation(good, good, {bounds}), InvalidInput);
  for (const double wrong : {-1.0, 100.1, std::nan("")}) {
    const double percentiles[] = {50, wrong};
    EXPECT_THROW(deviation(good, good, {{}, percentiles}), InvalidInput);
  }
  EXPECT_THROW(deviation({}, good), InvalidInput);
  EXPECT_THROW(deviation(good, {{{0, 0, std::nan("")}}, {{0, 0, 0}}}), InvalidInput);
  Progress progress;
  deviation(good, good, {{}, {}, 1, &progress});
  EXPECT_STREQ(progress.stage(), "averaging");
  EXPECT_EQ(progress.fraction(), 1);
  progress.cancel();
  EXPECT_THROW(deviation(good, good, {{}, {}, 1, &progress}), Cancelled);
}

}  // namespace
