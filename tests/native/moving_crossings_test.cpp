// SPDX-License-Identifier: GPL-3.0-or-later
// Judged by crossings() of all pairs, by CGAL where the mesh is a manifold, and by measure/hausdorff.h.
#include "motion/moving_crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <numeric>
#include <set>

#include "base/errors.h"
#include "crossing_judge.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "motion/constrain.h"
#include "motion/deformation.h"
#include "motion/guard.h"
#include "motion/smoothing.h"
#include "polls.h"
#include "shapes.h"
#include "topology/crossings.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using Crossed = PullBack::Crossings;

const StoredSpace kSingle(glm::dmat4(1), Storage::float32);
using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

Pairs pairs_of(std::span<const dvec3> vertices, std::span<const glm::uvec3> triangles) {
  Team alone(1);
  Pairs pairs;
  for (const glm::uvec2& p : crossings(vertices, triangles, 1'000'000, alone, nullptr).pairs) pairs.insert({p.x, p.y});
  return pairs;
}
Pairs pairs_of(const TriangleMesh& mesh) { return pairs_of(mesh.vertices, mesh.triangles); }

std::vector<std::uint32_t> indices(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> result;
  for (const glm::uvec3& t : mesh.triangles) result.insert(result.end(), {t.x, t.y, t.z});
  return result;
}

bool none_new(const Pairs& now, const Pairs& before) { return std::ranges::includes(before, now); }

std::size_t degenerate(const std::vector<dvec3>& vertices, const std::vector<glm::uvec3>& triangles) {
  const MeshView mesh{triangles, vertices};
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) count += is_degenerate(mesh.corners(i));
  return count;
}

/// Two plates above each other, 0.1 apart.
TriangleMesh sandwich(unsigned n = 8, double gap = 0.1) {
  TriangleMesh upper = shapes::grid(n);
  for (dvec3& p : upper.vertices) p.z = gap;
  return shapes::stored(shapes::joined(shapes::grid(n), upper));
}

/// A sphere within a sphere.
TriangleMesh hollow(unsigned n, double wall) {
  return shapes::stored(shapes::joined(shapes::sphere(n), shapes::turned(shapes::sphere(n, 1 - wall))));
}

/// A motion of a mesh over its own reference.
struct Motion {
  Motion(TriangleMesh m, double tolerance)
      : mesh(std::move(m)), tolerance(tolerance), volume(mesh.vertices, mesh.triangles, kSingle, tolerance) {}

  ConstrainResult run(const std::vector<dvec3>& wish, const ConstrainOptions& options = {}) const {
    return constrain(mesh.vertices, wish, indices(mesh), 3, kSingle, volume, options);
  }
  /// Each vertex goes by place(position) - position.
  template <class Place>
  std::vector<dvec3> wish(Place&& place) const {
    std::vector<dvec3> result;
    for (const dvec3& p : mesh.vertices) result.push_back(rounded_to_float32(place(p)));
    return result;
  }
  std::vector<dvec3> noise(double amount, unsigned seed) const {
    shapes::Random random(seed);
    return wish([&](const dvec3& p) { return p + amount * random.point(); });
  }
  double deviation(const std::vector<dvec3>& vertices) const {
    const TriangleMesh now{vertices, mesh.triangles};
    return std::max(hausdorff(now, mesh, {tolerance, 1, nullptr}).upper,
                    hausdorff(mesh, now, {tolerance, 1, nullptr}).upper);
  }

  TriangleMesh mesh;
  double tolerance;
  ToleranceVolume volume;
};

constexpr PullBack::Mode kModes[] = {PullBack::Mode::pull_back, PullBack::Mode::settle, PullBack::Mode::halve,
                                     PullBack::Mode::reset};

TEST(MovingCrossings, AFaceThatWouldMeetVeryManyKeepsAwayFromAll) {
  // A large triangle that slides a little, and many small ones above it that move down through it.
  for (const unsigned count : {40u, 60u, 200u}) {
    TriangleMesh mesh{{{-1, -1, 0}, {30, -1, 0}, {-1, 30, 0}}, {{0, 1, 2}}};
    for (unsigned i = 0; i < count; ++i) {
      const dvec3 place(0.5 * (i % 20), 0.5 * (i / 20), 0);
      const auto v = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const dvec3& p : {dvec3(0, 0, 0.1), dvec3(0.1, 0, 0.1), dvec3(0, 0, 0.2)})
        mesh.vertices.push_back(place + p);
      mesh.triangles.emplace_back(v, v + 1, v + 2);
    }
    const Motion motion(shapes::stored(mesh), 2);
    const std::vector<dvec3> wish =
        motion.wish([](const dvec3& p) { return p + (p.z == 0 ? dvec3(0.01, 0, 0) : dvec3(0, 0, -0.15)); });
    for (const auto mode : {PullBack::Mode::reset, PullBack::Mode::halve, PullBack::Mode::pull_back}) {
      ConstrainOptions options;
      options.mode = mode, options.two_sided = false;
      EXPECT_EQ(pairs_of(motion.run(wish, options).vertices, mesh.triangles), Pairs()) << count;
    }
  }
}

TEST(MovingCrossings, SheetsThatArePushedTogetherStayApart) {
  // In the middle each goes towards the other by more than the gap, and the tolerance permits it.
  const Motion motion(sandwich(), 0.3);
  ASSERT_TRUE(pairs_of(motion.mesh).empty());
  const std::vector<dvec3> bent = motion.wish([](const dvec3& p) {
    return p + dvec3(0, 0, (p.z > 0.05 ? -0.15 : 0.15) * std::sin(3 * p.x) * std::sin(3 * p.y));
  });
  for (const PullBack::Mode mode : kModes) {
    EXPECT_FALSE(pairs_of(motion.run(bent, {.mode = mode, .crossings = Crossed::allow}).vertices, motion.mesh.triangles)
                     .empty());
    const ConstrainResult kept = motion.run(bent, {.mode = mode});
    EXPECT_TRUE(pairs_of(kept.vertices, motion.mesh.triangles).empty());
    EXPECT_GT(kept.kept_from_crossing, 10u);
    EXPECT_LE(kept.kept_from_crossing, kept.held_back);
    EXPECT_LE(motion.deviation(kept.vertices), motion.tolerance);
    if (mode == PullBack::Mode::reset) continue;
    double lowest = 1;
    for (std::size_t v = 0; v < kept.vertices.size(); ++v) {
      if (motion.mesh.vertices[v].z > 0.05) lowest = std::min(lowest, kept.vertices[v].z);
    }
    EXPECT_LT(lowest, 0.08) << "they go a part of the way";
  }
}

TEST(MovingCrossings, NothingThatStaysApartIsHeldBack) {
  const Motion motion(shapes::torus(24), 0.1);
  const std::vector<dvec3> wish =
      motion.wish([](const dvec3& p) { return p + dvec3(0.02 * std::sin(4 * p.y), 0, 0.03); });
  const ConstrainResult kept = motion.run(wish);
  EXPECT_EQ(kept.vertices, wish);
  EXPECT_EQ(kept.kept_from_crossing, 0u);
}

TEST(MovingCrossings, AVertexGoesNotThroughTheFacesBesideIt) {
  // The middle of a plate goes over its rim in the plate's own plane: the faces around it fold over.
  const Motion motion(
      {{{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 0}}, {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}}}, 1);
  std::vector<dvec3> wish = motion.mesh.vertices;
  wish[4] = {1.5, 0, 0};
  // Nor may they turn over; that is another promise.
  const ConstrainOptions turning{.two_sided = false, .crossings = Crossed::allow, .max_normal_angle = 180};
  EXPECT_EQ(motion.run(wish, turning).vertices, wish);
  const ConstrainResult kept = motion.run(wish, {.two_sided = false, .max_normal_angle = 180});
  EXPECT_EQ(kept.kept_from_crossing, 1u);
  EXPECT_GT(kept.vertices[4].x, 0.4);
  EXPECT_LT(kept.vertices[4].x, 1);
  wish[4] = {1, 0, 0};
  EXPECT_LT(motion.run(wish).vertices[4].x, 1) << "the face on the right would be degenerate";
}

TEST(MovingCrossings, RingsStayInterlocked) {
  TriangleMesh one = shapes::torus(20), other = shapes::torus(20);
  for (dvec3& p : one.vertices) p = {p.x, p.y, 0.5 * p.z};
  for (dvec3& p : other.vertices) p = {p.x + 1, 0.5 * p.z, p.y};
  const Motion motion(shapes::stored(shapes::joined(one, other)), 0.8);
  ASSERT_TRUE(pairs_of(motion.mesh).empty());
  const std::size_t half = one.vertices.size();
  std::vector<dvec3> wish = motion.mesh.vertices;
  for (std::size_t v = half; v < wish.size(); ++v) wish[v] = rounded_to_float32(wish[v] + dvec3(0.5, 0, 0));
  for (const bool two_sided : {false, true}) {
    EXPECT_FALSE(pairs_of(motion.run(wish, {.two_sided = two_sided, .crossings = Crossed::allow}).vertices,
                          motion.mesh.triangles)
                     .empty());
    const ConstrainResult kept = motion.run(wish, {.two_sided = two_sided});
    EXPECT_TRUE(pairs_of(kept.vertices, motion.mesh.triangles).empty());
    EXPECT_GT(kept.kept_from_crossing, 5u);
  }
}

TEST(MovingCrossings, RandomMotionsOfThinWallsAgreeWithCgal) {
  const Motion motion(hollow(6, 0.04), 0.1);
  ASSERT_TRUE(crossings_by_cgal(motion.mesh).empty());
  std::size_t kept_back = 0, crossed = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    const std::vector<dvec3> wish = motion.noise(seed % 2 ? 0.02 : 0.1, seed);
    const ConstrainOptions options{.mode = kModes[seed % 4], .two_sided = seed % 3 > 0};
    crossed += crossings_by_cgal({wish, motion.mesh.triangles}).size();
    const ConstrainResult kept = motion.run(wish, options);
    kept_back += kept.kept_from_crossing;
    EXPECT_TRUE(crossings_by_cgal({kept.vertices, motion.mesh.triangles}).empty()) << seed;
    EXPECT_EQ(degenerate(kept.vertices, motion.mesh.triangles), 0u);
    if (options.two_sided) EXPECT_LE(motion.deviation(kept.vertices), motion.tolerance) << seed;
  }
  EXPECT_GT(crossed, 1'000u);
  EXPECT_GT(kept_back, 500u);
}

TEST(MovingCrossings, WhatCrossesMayGoOnAndNoOtherPairBegins) {
  // Two balls that overlap, with noise: many pairs cross at the start, and many motions move them.
  TriangleMesh other = shapes::sphere(6);
  for (dvec3& p : other.vertices) p.x += 1;
  const Motion motion(shapes::stored(shapes::joined(shapes::sphere(6), other)), 0.3);
  const Pairs before = pairs_of(motion.mesh);
  ASSERT_GT(before.size(), 20u);
  std::size_t left = 0, gained = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    const std::vector<dvec3> wish = motion.noise(0.05, seed);
    const Pairs now = pairs_of(motion.run(wish).vertices, motion.mesh.triangles);
    EXPECT_TRUE(none_new(now, before)) << seed;
    left += now.size();
    gained +=
        !none_new(pairs_of(motion.run(wish, {.crossings = Crossed::allow}).vertices, motion.mesh.triangles), before);
  }
  EXPECT_GT(left, 20u);
  EXPECT_EQ(gained, 8u);
}

TEST(MovingCrossings, AQuadIsKeptInBothOfItsTriangulations) {
  // Two bent quads above each other. One triangulation of the upper one is a ridge and the other a valley, and only the
  // valley comes down to the lower quad.
  const std::vector<std::uint32_t> quads{0, 1, 2, 3, 4, 5, 6, 7};
  const std::vector<dvec3> before{{0, 0, 0},       {1, 0, 0},       {1, 1, 0},       {0, 1, 0},
                                  {0.1, 0.1, 0.3}, {0.9, 0.1, 0.3}, {0.9, 0.9, 0.3}, {0.1, 0.9, 0.3}};
  const std::vector<glm::uvec3> reference{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  const ToleranceVolume volume(before, reference, kSingle, 0.5);
  for (const int first : {4, 5}) {  // two corners that are opposite go down, the others go up
    std::vector<dvec3> wish = before;
    for (int k = 4; k < 8; ++k) wish[std::size_t(k)].z += (k - first) % 2 == 0 ? -0.4 : 0.4;
    for (dvec3& p : wish) p = rounded_to_float32(p);
    const auto run = [&](Crossed crossings) {
      return constrain(before, wish, quads, 4, kSingle, volume, {.two_sided = false, .crossings = crossings});
    };
    EXPECT_EQ(run(Crossed::allow).kept_from_crossing, 0u);
    const ConstrainResult kept = run(Crossed::keep_out);
    EXPECT_GT(kept.kept_from_crossing, 0u);
    const std::vector<glm::uvec3> ways[2][2] = {{{{0, 1, 2}, {0, 2, 3}}, {{0, 1, 3}, {1, 2, 3}}},
                                                {{{4, 5, 6}, {4, 6, 7}}, {{4, 5, 7}, {5, 6, 7}}}};
    for (const std::vector<glm::uvec3>& lower : ways[0]) {
      for (const std::vector<glm::uvec3>& upper : ways[1]) {
        std::vector<glm::uvec3> triangles = lower;
        triangles.insert(triangles.end(), upper.begin(), upper.end());
        EXPECT_TRUE(pairs_of(kept.vertices, triangles).empty());
      }
    }
  }
}

TEST(MovingCrossings, AConcaveQuadHasAFoldOfItsOwn) {
  // The triangles 0, 1, 3 and 1, 2, 3 lie on each other once it is concave.
  const std::vector<std::uint32_t> quad{0, 1, 2, 3};
  const std::vector<dvec3> before{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  MovingCrossings crossings(quad, 4, before, 1);
  crossings.try_at(2, {0.25, 0.25, 0});
  EXPECT_TRUE(crossings.failing(std::vector{0u}, nullptr).empty());
  crossings.try_at(2, {0.5, 0.5, 0});
  EXPECT_EQ(crossings.failing(std::vector{0u}, nullptr), std::vector{0u}) << "a triangle of it is degenerate";
}

TEST(MovingCrossings, ATriangleAmongQuadsIsATriangle) {
  const Motion motion(hollow(3, 0.05), 0.2);
  const std::vector<dvec3> wish = motion.noise(0.08, 2);
  std::vector<std::uint32_t> quads;
  for (const glm::uvec3& t : motion.mesh.triangles) {
    for (const std::uint32_t v : {t.x, t.y, t.z, t.z}) quads.push_back(v);
  }
  const ConstrainOptions options{.two_sided = false};
  const ConstrainResult kept = constrain(motion.mesh.vertices, wish, quads, 4, kSingle, motion.volume, options);
  EXPECT_EQ(kept.vertices, motion.run(wish, options).vertices);
  EXPECT_GT(kept.kept_from_crossing, 10u);
}

TEST(MovingCrossings, FailingIsWhatBruteForceFinds) {
  const TriangleMesh mesh = hollow(4, 0.05);
  const std::vector<std::uint32_t> faces = indices(mesh);
  std::vector<std::uint32_t> all(mesh.triangles.size()), vertices(mesh.vertices.size());
  std::iota(all.begin(), all.end(), 0u), std::iota(vertices.begin(), vertices.end(), 0u);
  shapes::Random random(6);
  std::size_t found = 0, back = 0;
  for (const unsigned threads : {1u, 2u, 4u}) {
    MovingCrossings crossings(faces, 3, mesh.vertices, threads);
    for (int i = 0; i < 20; ++i) {
      std::vector<dvec3> trial = mesh.vertices;
      for (std::uint32_t v = 0; v < trial.size(); ++v) {
        if (random.below(4) == 0) trial[v] += 0.02 * random.point();
        crossings.try_at(v, trial[v]);
      }
      std::set<std::uint32_t> expected;
      for (const auto& [a, b] : pairs_of(trial, mesh.triangles)) expected.insert(a), expected.insert(b);
      const std::vector<std::uint32_t> failed = crossings.failing(all, nullptr);
      EXPECT_EQ(std::set<std::uint32_t>(failed.begin(), failed.end()), expected);
      EXPECT_TRUE(std::ranges::is_sorted(failed));
      found += failed.size();
      // Some go back to where they were, and only the faces around these are asked about.
      for (std::uint32_t f = 0; f < mesh.triangles.size(); f += 3) {
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t v = mesh.triangles[f][k];
          if (random.below(3) == 0) trial[v] = mesh.vertices[v];
          crossings.try_at(v, trial[v]);
        }
      }
      std::vector<std::uint32_t> asked;
      for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
        const glm::uvec3& t = mesh.triangles[f];
        if (trial[t.x] == mesh.vertices[t.x] || trial[t.y] == mesh.vertices[t.y] || trial[t.z] == mesh.vertices[t.z]) {
          asked.push_back(f);
        }
      }
      expected.clear();
      for (const auto& [a, b] : pairs_of(trial, mesh.triangles)) {
        if (std::ranges::binary_search(asked, a) || std::ranges::binary_search(asked, b)) {
          expected.insert(a), expected.insert(b);
        }
      }
      const std::vector<std::uint32_t> still = crossings.failing(asked, nullptr);
      EXPECT_EQ(std::set<std::uint32_t>(still.begin(), still.end()), expected);
      back += still.size();
      if (i % 2) crossings.take_back(vertices, all), crossings.tidy();
    }
  }
  EXPECT_GT(found, 300u);
  EXPECT_GT(back, 100u);
}

TEST(MovingCrossings, ThreadsDoNotChangeABit) {
  const Motion motion(hollow(8, 0.03), 0.1);
  const std::vector<dvec3> wish = motion.noise(0.03, 9);
  std::vector<std::vector<dvec3>> ends;
  for (const unsigned threads : {1u, 2u, 4u}) {
    ends.push_back(motion.run(wish, {.threads = threads}).vertices);
    ends.push_back(smooth(wish, motion.mesh.triangles, kSingle, &motion.volume,
                          {.iterations = 5, .outside = Outside::keep, .threads = threads})
                       .vertices);
  }
  for (std::size_t i = 2; i < ends.size(); ++i) {
    EXPECT_EQ(std::memcmp(ends[i].data(), ends[i % 2].data(), ends[i].size() * sizeof(dvec3)), 0);
  }
}

TEST(MovingCrossings, SmoothingKeepsWallsApart) {
  // The outer sphere shrinks towards the inner one, which stays.
  const Motion motion(hollow(6, 0.03), 0.3);
  ASSERT_TRUE(pairs_of(motion.mesh).empty());
  const std::size_t count = motion.mesh.vertices.size();
  const auto locked = std::make_unique<bool[]>(count);
  for (std::size_t v = count / 2; v < count; ++v) locked[v] = true;
  for (const auto weights : {SmoothingOptions::Weights::uniform, SmoothingOptions::Weights::cotangent}) {
    for (const bool reset : {false, true}) {
      if (kSanitized && reset != (weights == SmoothingOptions::Weights::uniform)) continue;
      SmoothingOptions options{.iterations = 30,
                               .kind = SmoothingOptions::Operator::laplacian,
                               .weights = weights,
                               .locked = {locked.get(), count},
                               .reset = reset};
      const auto run = [&] {
        return smooth(motion.mesh.vertices, motion.mesh.triangles, kSingle, &motion.volume, options);
      };
      const SmoothingResult kept = run();
      EXPECT_TRUE(pairs_of(kept.vertices, motion.mesh.triangles).empty());
      EXPECT_EQ(kept.kept_from_crossing.size(), 30u);
      EXPECT_GT(std::accumulate(kept.kept_from_crossing.begin(), kept.kept_from_crossing.end(), std::size_t{0}), 20u);
      for (std::size_t i = 0; i < 30; ++i) EXPECT_LE(kept.kept_from_crossing[i], kept.held_back[i]);
      options.crossings = Crossed::allow;
      std::size_t crossed = 0;
      for (options.iterations = 2; options.iterations < 30; options.iterations += 8) {
        crossed += pairs_of(run().vertices, motion.mesh.triangles).size();
      }
      EXPECT_GT(crossed, 20u);
    }
  }
}

TEST(MovingCrossings, EveryIterationOfASmoothingIsFreeOfCrossings) {
  const Motion clean(hollow(8, 0.03), 0.2);
  const std::vector<dvec3> rough = clean.run(clean.noise(0.04, 4)).vertices;
  for (unsigned iterations = 1; iterations < 25; iterations += kSanitized ? 4 : 1) {
    const SmoothingResult kept =
        smooth(rough, clean.mesh.triangles, kSingle, &clean.volume, {.iterations = iterations});
    EXPECT_TRUE(pairs_of(kept.vertices, clean.mesh.triangles).empty()) << iterations;
  }
}

TEST(MovingCrossings, ADeformationIsBlockedOrGoesAsFarAsNothingCrosses) {
  // A lattice that presses the plates of a sandwich together in the middle.
  const Motion motion(sandwich(10), 0.4);
  Lattice cage;
  cage.size = {4, 4, 4};
  cage.domain = glm::dmat4(1.2, 0, 0, 0, 0, 1.2, 0, 0, 0, 0, 0.3, 0, -0.1, -0.1, -0.1, 1);
  cage.points = rest_points(cage.size, cage.domain);
  for (dvec3& p : cage.points) p += dvec3(0, 0, 0.2 * std::sin(40 * p.z) * p.x);
  for (dvec3& p : cage.points) p.z = 0.05 - 3 * (p.z - 0.05) * std::sin(3 * p.x);
  const LatticeDeformation lattice(cage);
  using Mode = DeformationOptions::Mode;
  const auto run = [&](DeformationOptions options) {
    return deform(motion.mesh.vertices, indices(motion.mesh), 3, kSingle, &motion.volume, lattice, options);
  };
  const DeformationResult allowed = run({.crossings = Crossed::allow});
  EXPECT_EQ(allowed.leaving.faces, 0u);
  EXPECT_EQ(allowed.permitted_fraction, 1.0);
  ASSERT_FALSE(pairs_of(allowed.vertices, motion.mesh.triangles).empty());
  for (const bool two_sided : {false, true}) {
    const DeformationResult blocked = run({.mode = Mode::blocked, .two_sided = two_sided});
    EXPECT_EQ(blocked.leaving.faces, 0u);
    EXPECT_GT(blocked.crossing.faces, 10u);
    EXPECT_EQ(blocked.moved, 0u);
    const DeformationResult farthest = run({.mode = Mode::farthest, .two_sided = two_sided});
    EXPECT_TRUE(pairs_of(farthest.vertices, motion.mesh.triangles).empty());
    EXPECT_EQ(farthest.permitted_fraction, blocked.permitted_fraction);
    EXPECT_GT(*farthest.permitted_fraction, 0.05);
    EXPECT_LT(*farthest.permitted_fraction, 0.95);
    const DeformationResult pulled = run({.mode = Mode::pull_back, .two_sided = two_sided});
    EXPECT_TRUE(pairs_of(pulled.vertices, motion.mesh.triangles).empty());
    EXPECT_GT(pulled.kept_from_crossing, 5u);
    EXPECT_GT(pulled.moved, 50u);
  }
}

std::vector<float> flat(const std::vector<dvec3>& points) {
  std::vector<float> result;
  for (const dvec3& p : points) {
    for (int k = 0; k < 3; ++k) result.push_back(float(p[k]));
  }
  return result;
}

std::vector<dvec3> points(const std::vector<float>& flat) {
  std::vector<dvec3> result;
  for (std::size_t i = 0; i < flat.size(); i += 3) result.emplace_back(flat[i], flat[i + 1], flat[i + 2]);
  return result;
}

TEST(MovingCrossings, AGuardKeepsThroughManyDabs) {
  const Motion motion(hollow(9, 0.04), 0.15);
  const int dabs = kSanitized ? 50 : 200;
  for (const Crossed crossings : {Crossed::keep_out, Crossed::allow}) {
    Guard guard(flat(motion.mesh.vertices), indices(motion.mesh), 3, glm::dmat4(1), motion.volume,
                {.crossings = crossings});
    std::vector<float> now = flat(motion.mesh.vertices);
    shapes::Random random(11);
    std::size_t crossed = 0;
    for (int dab = 0; dab < dabs; ++dab) {
      const std::vector<dvec3> at = points(now);
      const dvec3 middle = at[random.below(unsigned(at.size()))], way = 0.05 * random.point();
      for (std::size_t v = 0; v < at.size(); ++v) {
        const double share = glm::length(at[v] - middle) / 0.4;
        // Of the two spheres the outer one alone is sculpted.
        for (int k = 0; share < 1 && v < at.size() / 2 && k < 3; ++k)
          now[3 * v + std::size_t(k)] += float((1 - share) * way[k]);
      }
      const Guard::Correction back = guard.constrain(now);
      for (std::size_t i = 0; i < back.vertices.size(); ++i) {
        std::copy_n(&back.positions[3 * i], 3, &now[std::size_t{3} * back.vertices[i]]);
      }
      crossed += pairs_of(points(now), motion.mesh.triangles).size();
      EXPECT_TRUE(guard.constrain(now).vertices.empty()) << "what it left is a state";
    }
    EXPECT_EQ(crossed == 0, crossings == Crossed::keep_out);
    EXPECT_LE(motion.deviation(points(now)), motion.tolerance);
  }
}

TEST(MovingCrossings, UndoGoesBackToCrossingsOfTheStart) {
  TriangleMesh other = shapes::sphere(4);
  for (dvec3& p : other.vertices) p.x += 1;
  const Motion motion(shapes::stored(shapes::joined(shapes::sphere(4), other)), 3);
  const std::vector<float> start = flat(motion.mesh.vertices);
  Guard guard(start, indices(motion.mesh), 3, glm::dmat4(1), motion.volume, {.crossings = Crossed::keep_out});
  std::vector<float> apart = start;
  for (std::size_t i = start.size() / 2; i < start.size(); i += 3) apart[i] += 2;
  ASSERT_TRUE(pairs_of(points(apart), motion.mesh.triangles).empty());
  EXPECT_TRUE(guard.constrain(apart).vertices.empty());
  EXPECT_TRUE(guard.constrain(start).vertices.empty()) << "undone";
  guard.reset(apart);
  EXPECT_FALSE(guard.constrain(start).vertices.empty()) << "it starts anew without crossings";
}

TEST(MovingCrossings, ACancelInTheMiddleKeepsTheState) {
  const Motion motion(hollow(6, 0.04), 0.1);
  const std::vector<float> start = flat(motion.mesh.vertices), wish = flat(motion.noise(0.05, 3));
  const auto made = [&] {
    return Guard(start, indices(motion.mesh), 3, glm::dmat4(1), motion.volume,
                 {.crossings = Crossed::keep_out, .threads = 1});
  };
  Guard fresh = made();
  std::size_t polls = 0;
  const Guard::Correction expected = [&] {
    const Counted whole;
    Guard::Correction correction = fresh.constrain(wish);
    polls = whole.polls;
    return correction;
  }();
  ASSERT_GT(polls, 50u);
  for (std::size_t last = 1; last < polls; last += std::max<std::size_t>(1, polls / (kSanitized ? 10 : 40))) {
    Guard guard = made();
    {
      const Counted cancelled(last);
      EXPECT_THROW(guard.constrain(wish), Cancelled) << last;
    }
    const Guard::Correction correction = guard.constrain(wish);
    EXPECT_EQ(correction.vertices, expected.vertices) << last;
    EXPECT_EQ(correction.positions, expected.positions) << last;
  }
  const auto smoothed = [&] {
    smooth(motion.mesh.vertices, motion.mesh.triangles, kSingle, &motion.volume, {.iterations = 3, .threads = 1});
  };
  const std::size_t whole = polls_of(smoothed);
  for (std::size_t last = 1; last < whole; last += whole / 10) {
    const Counted cancelled(last);
    EXPECT_THROW(smoothed(), Cancelled) << last;
  }
}

TEST(MovingCrossings, LongWaysOfManyFacesEndSoon) {
  // All of a plate goes far along itself, but for one vertex: the faces of the others come to lie across it.
  const Motion motion(shapes::stored(shapes::grid(30)), 1.2);
  std::vector<dvec3> wish = motion.wish([](const dvec3& p) { return p + dvec3(1, 0.3, 0); });
  wish[480] = motion.mesh.vertices[480];
  const std::size_t polls = polls_of([&] {
    const ConstrainResult kept = motion.run(wish, {.threads = 1});
    EXPECT_TRUE(pairs_of(kept.vertices, motion.mesh.triangles).empty());
  });
  EXPECT_LT(polls, 20'000u);
}

TEST(MovingCrossings, PointsAndSegmentsNeverCross) {
  const TriangleMesh mesh = shapes::torus(8);
  const ToleranceVolume volume(mesh.vertices, mesh.triangles, kSingle, 0.5);
  std::vector<std::uint32_t> edges;
  for (const glm::uvec3& t : mesh.triangles) edges.insert(edges.end(), {t.x, t.y});
  std::vector<dvec3> wish = mesh.vertices;
  for (dvec3& p : wish) p = rounded_to_float32(1.01 * p);
  EXPECT_EQ(constrain(mesh.vertices, wish, edges, 2, kSingle, volume, {.two_sided = false}).vertices, wish);
}

}  // namespace
