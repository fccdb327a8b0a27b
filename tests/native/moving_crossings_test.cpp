// SPDX-License-Identifier: GPL-3.0-or-later
// Judged by crossings() of all pairs, by CGAL where the mesh is a manifold, and by measure/hausdorff.h.
#include "motion/moving_crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "crossing_judge.h"
#include "motion/constrain.h"
#include "polls.h"
#include "shapes.h"
#include "walls.h"

namespace {

using namespace tolvol;
using namespace tolvol::walls;

std::size_t degenerate(const std::vector<dvec3>& vertices, const std::vector<glm::uvec3>& triangles) {
  const MeshView mesh{triangles, vertices};
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) count += is_degenerate(mesh.corners(i));
  return count;
}

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
    if (options.two_sided) {
      EXPECT_LE(motion.deviation(kept.vertices), motion.tolerance) << seed;
    }
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

/// A plate of n x n squares, and where its vertices lie after each has gone by noise of so many widths of a square.
struct Tangle {
  Tangle(unsigned n, double widths) : plate(shapes::stored(shapes::grid(n))), faces(indices(plate)) {
    shapes::Random random(5);
    for (const dvec3& p : plate.vertices) place.push_back(rounded_to_float32(p + widths / n * random.point()));
    all.resize(plate.triangles.size());
    std::iota(all.begin(), all.end(), 0u);
  }
  TriangleMesh plate;
  std::vector<std::uint32_t> faces, all;
  std::vector<dvec3> place;
};

TEST(MovingCrossings, AllThatCrossAreToldWhereverVeryManyDo) {
  for (const double widths : {0.3, 1.0, 5.0}) {
    const Tangle tangle(30, widths);
    std::set<std::uint32_t> expected;
    for (const auto& [a, b] : pairs_of(tangle.place, tangle.plate.triangles)) expected.insert({a, b});
    std::vector<std::uint32_t> of_both;
    for (const unsigned threads : {1u, 3u}) {
      MovingCrossings crossings(tangle.faces, 3, tangle.plate.vertices, threads);
      for (std::uint32_t v = 0; v < tangle.place.size(); ++v) crossings.try_at(v, tangle.place[v]);
      const std::vector<std::uint32_t> failing = crossings.failing(tangle.all, nullptr);
      EXPECT_EQ(failing, std::vector(expected.begin(), expected.end())) << widths;
      EXPECT_EQ(crossings.failing(tangle.all, nullptr), failing) << "asked again";
      // Half of them stand for those that moved since.
      std::vector<std::uint32_t> half(tangle.all.begin(), tangle.all.begin() + tangle.all.size() / 2);
      const std::vector<std::uint32_t> of_half = crossings.failing(half, nullptr);
      EXPECT_TRUE(std::ranges::includes(failing, of_half));
      for (const std::uint32_t f : half) {
        EXPECT_EQ(std::ranges::binary_search(of_half, f), expected.contains(f)) << f;
      }
      if (threads == 1) of_both = of_half;
      EXPECT_EQ(of_half, of_both) << threads << " threads";
    }
  }
}

TEST(MovingCrossings, AFaceOfATangleIsComparedWithFew) {
  const Tangle tangle(40, 4);
  MovingCrossings crossings(tangle.faces, 3, tangle.plate.vertices, 1);
  for (std::uint32_t v = 0; v < tangle.place.size(); ++v) crossings.try_at(v, tangle.place[v]);
  // A face polls once for each 64 others that its box meets, and here it meets hundreds.
  const std::size_t count = tangle.all.size();
  EXPECT_LT(polls_of([&] { EXPECT_GT(crossings.failing(tangle.all, nullptr).size(), count / 2); }), 3 * count);
  EXPECT_LT(polls_of([&] { crossings.failing(tangle.all, nullptr); }), 3 * count / 2) << "it meets the same one again";
}

TEST(MovingCrossings, InATangleFacesWithHighNumbersComePastFewToo) {
  const Tangle tangle(60, 20);
  MovingCrossings crossings(tangle.faces, 3, tangle.plate.vertices, 1);
  for (std::uint32_t v = 0; v < tangle.place.size(); ++v) crossings.try_at(v, tangle.place[v]);
  const std::size_t count = tangle.all.size();
  // A face's box meets thousands.
  EXPECT_LT(polls_of([&] { EXPECT_GT(crossings.failing(tangle.all, nullptr).size(), count - 10); }), 2 * count);
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
