// SPDX-License-Identifier: GPL-3.0-or-later
// Smoothing, deformation and Guard keep out crossings, as constrain() does in moving_crossings_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <numeric>

#include "base/errors.h"
#include "many.h"
#include "motion/deformation.h"
#include "motion/guard.h"
#include "motion/smoothing.h"
#include "polls.h"
#include "shapes.h"
#include "walls.h"

namespace {

using namespace tolvol;
using namespace tolvol::walls;

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

// All faces of a torus are thrown about by many times their size, and nearly all cross others until they are almost
// back.
TEST(MovingCrossings, ATangleGoesBackInFewRounds) {
  const Motion motion(shapes::torus(60), 0.5);
  ConstrainResult end;
  EXPECT_LT(polls_of([&] { end = motion.run(motion.noise(0.5, 3), {.two_sided = false, .threads = 1}); }), 25000u);
  EXPECT_TRUE(pairs_of(end.vertices, motion.mesh.triangles).empty());
}

TEST(MovingCrossings, SmoothingHoldsAVertexWhereLittleOfTheToleranceIsLeftOfItsStep) {
  const Motion motion(hollow(6, 0.03), 0.3);
  const std::size_t count = motion.mesh.vertices.size();
  const auto locked = std::make_unique<bool[]>(count);
  for (std::size_t v = count / 2; v < count; ++v) locked[v] = true;
  SmoothingOptions options{.kind = SmoothingOptions::Operator::laplacian, .locked = {locked.get(), count}};
  const auto run = [&](const std::vector<dvec3>& from, unsigned iterations, const ToleranceVolume* volume) {
    options.iterations = iterations;
    return smooth(from, motion.mesh.triangles, kSingle, volume, options);
  };
  std::vector<dvec3> before = motion.mesh.vertices;
  std::size_t held = 0;
  for (unsigned n = 1; n <= 12; ++n) {
    const std::vector<dvec3> wish = run(before, 1, nullptr).vertices;
    const SmoothingResult now = run(motion.mesh.vertices, n, &motion.volume);
    for (std::size_t v = 0; v < count / 2; ++v) {
      if (now.vertices[v] == wish[v]) continue;
      ++held;
      const double went = glm::length(now.vertices[v] - before[v]);
      EXPECT_TRUE(went == 0 || went > 0.029 * motion.tolerance) << n << ' ' << v << ' ' << went;
    }
    before = now.vertices;
  }
  EXPECT_GT(held, 20u);
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
  std::vector<std::size_t> cancels;
  for (std::size_t last = 1; last < polls; last += std::max<std::size_t>(1, polls / (kSanitized ? 10 : 40))) {
    cancels.push_back(last);
  }
  // The last polls are those nearest to where the state changes.
  for (std::size_t last = polls - 10; last <= polls; ++last) cancels.push_back(last);
  for (const std::size_t last : cancels) {
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

}  // namespace
