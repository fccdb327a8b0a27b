// SPDX-License-Identifier: GPL-3.0-or-later
// How much work long loops take, on how many threads it is done, and how it is cancelled.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/errors.h"
#include "base/progress.h"
#include "geometry/weld.h"
#include "holes.h"
#include "many.h"
#include "polls.h"
#include "repair/close_holes.h"
#include "repair/filling.h"
#include "repair/filling_rules.h"
#include "shapes.h"
#include "topology/boundary_loops.h"
#include "without.h"

namespace {

using namespace tolvol;
using namespace tolvol::holes;

TEST(CloseHoles, ALongBorderIsRefusedAtOnce) {
  const unsigned n = 100000;
  TriangleMesh mesh;
  for (unsigned i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * i / n;
    for (const double r : {1.0, 1.01}) mesh.vertices.emplace_back(r * std::cos(a), r * std::sin(a), 0);
  }
  for (unsigned i = 0; i < n; ++i) {
    const unsigned a = 2 * i, b = 2 * ((i + 1) % n);
    mesh.triangles.emplace_back(a, a + 1, b), mesh.triangles.emplace_back(b, a + 1, b + 1);
  }
  const auto volume = volume_of(mesh, 0.1);
  std::vector<LoopOutcome> found;
  const std::size_t polls =
      polls_of([&] { found = outcomes(close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, {.threads = 1})); });
  EXPECT_EQ(found, (Outcomes{LoopOutcome::too_long, LoopOutcome::too_long}));
  EXPECT_LT(polls, n / 80);
}

TEST(CloseHoles, TheBorderOfALargeSheetIsRefusedSoon) {
  // 800 corners, and a tolerance of many edges: hardly a part of the loop has a triangulation.
  TriangleMesh mesh = shapes::grid(200);
  const auto volume = volume_of(mesh, 0.05);
  const std::size_t polls = polls_of([&] {
    EXPECT_EQ(outcomes(close_holes(mesh.vertices, mesh.triangles, kSpace, *volume)), Outcomes{LoopOutcome::turned});
  });
  EXPECT_LT(polls, 800u * 800u);
}

/// A grid of n x n squares without those from `first` to before `end` along both sides.
TriangleMesh with_square_hole(const TriangleMesh& grid, unsigned n, unsigned first, unsigned end) {
  return without(grid, [&](unsigned t) {
    const unsigned row = t / 2 / n, column = t / 2 % n;
    return row >= first && row < end && column >= first && column < end;
  });
}

/// The polls of closing the square hole of a flat grid, but not its border.
std::size_t polls_of_square_hole(unsigned n, unsigned first, unsigned end, double tolerance) {
  const TriangleMesh whole = shapes::grid(n), mesh = with_square_hole(whole, n, first, end);
  const auto volume = volume_of(whole, tolerance);
  CloseHolesOptions options;
  options.largest_perimeter = 3;  // between those of the hole, at most 2.4, and of the border, 4
  return polls_of([&] {
    const HoleClosingResult result = close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, options);
    EXPECT_EQ(outcomes(result), (Outcomes{LoopOutcome::perimeter, LoopOutcome::closed}));
  });
}

TEST(CloseHoles, AWideHoleNeedsFewProofs) {
  // 144 corners; the proof of a triangle across the hole takes thousands of parts, and only 142 triangles need one.
  EXPECT_LT(polls_of_square_hole(60, 12, 48, 0.002), 18000u);
}

TEST(CloseHoles, AWideHoleWithALongRimNeedsFewProofs) {
  // 240 corners, and triangles across the hole that take hundreds of parts each: a long loop has one guess.
  EXPECT_LT(polls_of_square_hole(200, 70, 130, 0.005), 70000u);  // 91,748 without a guess
}

TEST(CloseHoles, ALoopThatMeandersIsGivenUp) {
  // Many triangles between the corners of a long loop are within the tolerance and most of them are refused.
  shapes::Random random(6);
  TriangleMesh mesh = plate(24, 0.06, [](unsigned, unsigned) { return false; });
  mesh = without(mesh, [&](unsigned) { return random.share() < 0.5; });
  const auto volume = volume_of(mesh, 0.25);
  HoleClosingResult result;
  const std::size_t polls =
      polls_of([&] { result = close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, {.threads = 1}); });
  judge(mesh, result, 0.25);
  const auto longest = std::ranges::max_element(result.loops, {}, &HoleClosingResult::Loop::corners);
  EXPECT_EQ(longest->corners, 270u);
  EXPECT_EQ(longest->outcome, LoopOutcome::given_up);
  EXPECT_LT(polls, 120000u);  // 158,376 without an end
}

TEST(CloseHoles, AHoleIsGivenUpAfterItsStepsOfProofs) {
  // The wavy surface across the hole refuses the one guess that a long loop has, and then thousands of triangles.
  const unsigned n = 200;
  TriangleMesh whole = shapes::grid(n);
  for (dvec3& p : whole.vertices) p.z = 0.05 * std::sin(7 * p.x) * std::sin(5 * p.y);
  const TriangleMesh mesh = with_square_hole(whole, n, 70, 130);
  const auto volume = volume_of(whole, 0.003);
  const std::vector<std::uint32_t> place = weld_equal_positions(mesh.vertices);
  Team alone(1);
  const std::vector<BoundaryLoop> loops =
      boundary_loops(kSpace.in(volume->frame()).frame(mesh.vertices), place, mesh.triangles, alone);
  ASSERT_EQ(loops.size(), 2u);
  std::vector<Hole> holes(1);
  holes[0].sides = loops[1].sides;
  for (const std::uint32_t side : holes[0].sides) {
    holes[0].corner.push_back(mesh.triangles[side / 3][static_cast<int>(side % 3)]);
    holes[0].at.push_back(volume->frame().from_world(mesh.vertices[holes[0].corner.back()]));
  }
  ASSERT_EQ(holes[0].corner.size(), 240u);
  const MeshView view{mesh.triangles, mesh.vertices};
  std::vector<std::string> warnings;
  const FillingRules rules(view, place, holes, kSpace.in(volume->frame()), *volume, {},
                           CloseHolesOptions().max_normal_angle, alone, warnings);
  rules.measure(holes[0]);
  const auto polls_with = [&](std::size_t steps, LoopOutcome outcome) {
    Hole hole = holes[0];
    hole.most_steps = steps;
    return polls_of([&] { EXPECT_EQ(Filling(rules, hole).run(), outcome); });
  };
  const std::size_t few = polls_with(100'000, LoopOutcome::given_up);
  EXPECT_LT(few, polls_with(1'000'000'000, LoopOutcome::closed));
}

TEST(CloseHoles, HolesAtAHubAreComparedWithFewOfItsFaces) {
  // Two cones over one rim; around one apex each 20th face is a hole. The boxes of a quarter of its faces meet there.
  const unsigned n = 6000;
  TriangleMesh whole;
  for (unsigned i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * i / n, y = std::sin(a);
    whole.vertices.emplace_back(std::cos(a), 0.8 * y, 0.6 * y);
  }
  for (const double height : {0.3, -0.3}) whole.vertices.emplace_back(0, -0.6 * height, 0.8 * height);
  for (unsigned i = 0; i < n; ++i) {
    whole.triangles.emplace_back(i, (i + 1) % n, n);
    whole.triangles.emplace_back((i + 1) % n, i, n + 1);
  }
  const TriangleMesh mesh = without(whole, [](unsigned t) { return t % 40 == 0; });
  const auto volume = volume_of(whole, 0.01);
  HoleClosingResult result;
  const std::size_t polls =
      polls_of([&] { result = close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, {.threads = 1}); });
  EXPECT_EQ(result.count(LoopOutcome::closed), n / 20);
  EXPECT_LT(polls, 20000u);
}

TEST(CloseHoles, ManyThreadsGiveTheSameBits) {
  shapes::Random random(8);
  for (int round = 0; round < many(4); ++round) {
    const TriangleMesh mesh = without(shapes::torus(40, 0.02), [&](unsigned) { return random.share() < 0.25; });
    const auto volume = volume_of(mesh, 0.15);
    const HoleClosingResult one = close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, {.threads = 1});
    const HoleClosingResult four = close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, {.threads = 4});
    judge(mesh, one, 0.15);
    EXPECT_GT(one.count(LoopOutcome::closed), 50u);
    EXPECT_EQ(one.triangles, four.triangles);
    EXPECT_EQ(one.borders, four.borders);
    EXPECT_EQ(one.corner_source, four.corner_source);
    EXPECT_EQ(outcomes(one), outcomes(four));
  }
}

TEST(CloseHoles, StopsWhenTheCallIsCancelled) {
  const TriangleMesh mesh = tube(150, 0.02, 1, 4);
  const auto volume = volume_of(mesh, 0.03);
  HoleClosingResult result;
  const std::size_t polls =
      polls_of([&] { result = close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, {.threads = 1}); });
  EXPECT_EQ(result.count(LoopOutcome::closed), 2u);
  for (const std::size_t at : {polls / 3, polls / 2, polls - 2}) {
    const Counted stops(at);
    EXPECT_THROW(close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, {.threads = 1}), Cancelled);
  }
  Progress progress;
  progress.cancel();
  EXPECT_THROW(close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, {.progress = &progress}), Cancelled);
}

}  // namespace
