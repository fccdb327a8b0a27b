// SPDX-License-Identifier: GPL-3.0-or-later
// Judged by measure/hausdorff.h on the float32 positions that the caller holds.
#include "motion/guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kTolerance = 0.03;

struct Sculpture {
  explicit Sculpture(TriangleMesh m = shapes::torus(40), std::optional<double> precision = {},
                     const glm::dmat4& matrix = glm::dmat4(1))
      : mesh(std::move(m)),
        to_world(matrix),
        volume(mesh.vertices, mesh.triangles, {to_world, Storage::float32}, kTolerance, {precision}),
        positions(shapes::flat(mesh.vertices)) {}
  TriangleMesh mesh;
  glm::dmat4 to_world;
  ToleranceVolume volume;
  std::vector<float> positions;

  std::vector<std::uint32_t> faces() const { return shapes::indices(mesh); }
  Guard guard(const Guard::Options& options = {}) const { return {positions, faces(), 3, to_world, volume, options}; }
  dvec3 at(std::size_t v) const { return {positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]}; }
  void push(std::size_t v, const dvec3& by) {
    for (int k = 0; k < 3; ++k) positions[3 * v + k] += float(by[k]);
  }
  /// Pushes the vertices within `radius` of one away from the origin, by `amount` in the middle.
  void dab(std::size_t centre, double radius, double amount) {
    const dvec3 middle = at(centre);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const double share = glm::length(at(v) - middle) / radius;
      if (share < 1) push(v, amount * (1 - share) * glm::normalize(middle));
    }
  }
  void correct(const Guard::Correction& correction) {
    for (std::size_t i = 0; i < correction.vertices.size(); ++i) {
      std::copy_n(&correction.positions[3 * i], 3, &positions[3 * correction.vertices[i]]);
    }
  }
  double deviation() const {
    TriangleMesh now = mesh;
    for (std::size_t v = 0; v < now.vertices.size(); ++v) now.vertices[v] = at(v);
    return std::max(hausdorff(now, mesh, {kTolerance, 1, nullptr}).upper,
                    hausdorff(mesh, now, {kTolerance, 1, nullptr}).upper);
  }
};

TEST(Guard, KeepsEveryDabInside) {
  Sculpture s;
  Guard guard = s.guard();
  std::size_t corrected = 0;
  for (int i = 0; i < (kSanitized ? 20 : 30); ++i) {
    s.dab(7 + 50 * std::size_t(i), 0.4, i % 3 == 0 ? 0.08 : -0.05);
    const std::vector<float> wish = s.positions;
    const Guard::Correction correction = guard.constrain(s.positions);
    s.correct(correction);
    for (std::size_t v = 0, c = 0; v < s.mesh.vertices.size(); ++v) {
      if (c < correction.vertices.size() && correction.vertices[c] == v) {
        ++c;
      } else {
        ASSERT_EQ(std::memcmp(&wish[3 * v], &s.positions[3 * v], 12), 0) << "not moved back";
      }
    }
    corrected += correction.vertices.size();
    ASSERT_LE(s.deviation(), kTolerance) << i;
  }
  EXPECT_GT(corrected, 100u);
  EXPECT_GT(s.deviation(), 0.95 * kTolerance) << "it gets as far as it may";
}

TEST(Guard, ADabCostsWhatItMovesHoweverLargeTheMeshIs) {
  for (const bool keep_out : {false, true}) {
    std::size_t polls[2] = {}, held[2] = {}, moved = 0;
    for (const bool large : {false, true}) {
      TriangleMesh beside = shapes::torus(120);
      for (dvec3& p : beside.vertices) p.x += 4;
      Sculpture s(large ? shapes::joined(shapes::torus(40), beside) : shapes::torus(40));
      using Crossings = PullBack::Crossings;
      Guard guard = s.guard({.crossings = keep_out ? Crossings::keep_out : Crossings::allow, .threads = 1});
      const std::vector<float> before = s.positions;
      s.dab(100, 0.8, 0.06);
      moved = 0;
      for (std::size_t v = 0; v < s.mesh.vertices.size(); ++v) {
        moved += std::memcmp(&before[3 * v], &s.positions[3 * v], 12) != 0;
      }
      polls[large] = polls_of([&] { held[large] = guard.constrain(s.positions).vertices.size(); });
    }
    EXPECT_EQ(held[0], held[1]);
    EXPECT_GT(held[0], 40u);
    EXPECT_LE(polls[0], moved);
    EXPECT_LE(polls[1], polls[0] + polls[0] / 20) << "the mesh has ten times as many faces";
  }
}

TEST(Guard, AgreesWithConstrainButForTheLastFourPercentAlmostEverywhere) {
  // Where a face finds no proof just there, a guard that must be quick settles for half of the way. Two-sided, vertices
  // go back by shares of the way from where each of the two had put them.
  for (const bool two_sided : {false, true}) {
    std::size_t held = 0, apart = 0;
    Sculpture s;
    for (std::size_t centre = 50; centre < 1'600; centre += kSanitized ? 150 : 50) {
      s.positions = shapes::flat(s.mesh.vertices);
      Guard guard = s.guard({.two_sided = two_sided});
      const std::vector<dvec3> before = s.mesh.vertices;
      s.dab(centre, 0.5, 0.08);
      std::vector<dvec3> wish;
      for (std::size_t v = 0; v < before.size(); ++v) wish.push_back(s.at(v));
      const ConstrainResult exact =
          constrain(before, wish, s.faces(), 3, {s.to_world, Storage::float32}, s.volume, {.two_sided = two_sided});
      const Guard::Correction correction = guard.constrain(s.positions);
      s.correct(correction);
      held += correction.vertices.size();
      for (std::size_t v = 0; v < before.size(); ++v) {
        apart += glm::length(s.at(v) - exact.vertices[v]) > 0.1 * kTolerance;
      }
    }
    EXPECT_GT(held, kSanitized ? 150u : 500u);
    EXPECT_LE(apart, held / (two_sided ? 10 : 100));
  }
}

TEST(Guard, WhoIsAtTheLimitStaysThereOrGoesTheOtherWay) {
  Sculpture s;
  Guard guard = s.guard();
  const auto pushed = [&](double amount) {
    s.dab(100, 0.4, amount);
    s.correct(guard.constrain(s.positions));
    return s.at(100);
  };
  const dvec3 outwards = pushed(0.2);
  EXPECT_EQ(pushed(0.02), outwards);
  const dvec3 inwards = pushed(-0.5);
  EXPECT_GT(glm::length(inwards - outwards), 1.8 * kTolerance);
  EXPECT_GT(glm::length(pushed(200) - inwards), 1.8 * kTolerance) << "thousands of tolerances away";
  EXPECT_LE(s.deviation(), kTolerance);
}

TEST(Guard, OneSidedWhatAStrokeDoesDoesNotDependOnWhatWasBefore) {
  // Two-sided it may, because pieces of the reference keep their witnesses for as long as they can.
  Sculpture s(shapes::torus(120));
  Guard guard = s.guard({.two_sided = false});
  std::size_t held = 0;
  for (int i = 0; i < (kSanitized ? 8 : 20); ++i) {
    Guard fresh = s.guard({.two_sided = false});
    s.dab(1'000 + 3 * std::size_t(i), 0.4, i % 7 == 6 ? -0.05 : 0.02);
    const Guard::Correction correction = guard.constrain(s.positions), expected = fresh.constrain(s.positions);
    ASSERT_EQ(correction.vertices, expected.vertices) << i;
    ASSERT_EQ(correction.positions, expected.positions) << i;
    s.correct(correction);
    held += correction.vertices.size();
  }
  EXPECT_GT(held, kSanitized ? 200u : 500u);
}

TEST(Guard, WhereverAnEditIsInsideItIsKept) {
  // A reference of many small triangles, of which the grid names few: its guesses are often beyond the tolerance.
  for (const double precision : {1.0, 0.5, 0.25}) {
    Sculpture s(shapes::torus(120), precision);
    Guard guard = s.guard();
    for (const double angle : {2.0, -1.0, 0.5}) {  // in its own surface, far from where each vertex was
      for (std::size_t v = 0; v < s.mesh.vertices.size(); ++v) {
        const dvec3 p = s.at(v), to(std::cos(angle) * p.x - std::sin(angle) * p.y,
                                    std::sin(angle) * p.x + std::cos(angle) * p.y, p.z);
        s.push(v, to - p);
      }
      EXPECT_TRUE(guard.constrain(s.positions).vertices.empty()) << precision << ", " << angle;
    }
    s.dab(1'000, 0.5, 0.95 * kTolerance);
    EXPECT_TRUE(guard.constrain(s.positions).vertices.empty()) << precision;
  }
}

TEST(Guard, NothingMovedIsNothingToDoAndUndoIsAnEdit) {
  Sculpture s;
  Guard guard = s.guard();
  EXPECT_TRUE(guard.constrain(s.positions).vertices.empty());
  const std::vector<float> start = s.positions;
  s.dab(100, 0.5, 0.02);
  EXPECT_TRUE(guard.constrain(s.positions).vertices.empty()) << "inside";
  EXPECT_TRUE(guard.constrain(start).vertices.empty()) << "undone";
  EXPECT_TRUE(guard.constrain(s.positions).vertices.empty()) << "done again";
}

TEST(Guard, PullsBackTowardsTheLastGoodState) {
  Sculpture s;
  Guard guard = s.guard();
  s.dab(100, 0.5, 0.02);
  guard.constrain(s.positions);
  const dvec3 good = s.at(100);
  s.push(100, {0, 0, 5});
  const Guard::Correction correction = guard.constrain(s.positions);
  ASSERT_EQ(correction.vertices, std::vector<std::uint32_t>{100});
  s.correct(correction);
  EXPECT_LT(glm::length(s.at(100) - good), 0.3);
  EXPECT_NEAR(s.at(100).x, good.x, 1e-6);
  EXPECT_LE(s.deviation(), kTolerance);
}

TEST(Guard, TheResultDoesNotDependOnThreads) {
  std::vector<float> ends[2];
  for (const unsigned threads : {1u, 3u}) {
    Sculpture s;
    Guard guard = s.guard({.threads = threads});
    for (const std::size_t v : {5, 500, 900}) {
      s.dab(v, 1.0, 0.06);
      s.correct(guard.constrain(s.positions));
    }
    ends[threads / 3] = s.positions;
  }
  EXPECT_EQ(ends[0], ends[1]);
}

TEST(Guard, FollowsTheMatrix) {
  glm::dmat4 doubled(2);
  doubled[3][3] = 1;
  Sculpture s(shapes::grid(8), {}, doubled);
  Guard guard = s.guard();
  for (std::size_t v = 0; v < s.mesh.vertices.size(); ++v) s.positions[3 * v + 2] = 1;
  const Guard::Correction correction = guard.constrain(s.positions);
  ASSERT_EQ(correction.vertices.size(), s.mesh.vertices.size());
  for (std::size_t i = 0; i < correction.vertices.size(); ++i) {
    EXPECT_NEAR(correction.positions[3 * i + 2], kTolerance / 2, 0.05 * kTolerance / 2);
  }
}

TEST(Guard, BadInputKeepsTheState) {
  Sculpture s;
  Guard guard = s.guard();
  const std::vector<float> good = s.positions;
  s.positions[30] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(guard.constrain(s.positions), InvalidInput);
  s.positions = good;
  s.push(10, {0, 0, 1});
  EXPECT_THROW(guard.reset(s.positions), InvalidInput) << "outside";
  EXPECT_THROW(s.guard(), InvalidInput);
  EXPECT_THROW(guard.constrain(std::vector<float>(9)), InvalidInput);
  EXPECT_THROW(guard.reset(std::vector<float>(9)), InvalidInput);
  s.correct(guard.constrain(s.positions));
  EXPECT_LE(s.deviation(), kTolerance) << "works on from the last good state";
}

TEST(Guard, KeepsWhatIsOutsideWhenAsked) {
  Sculpture s;
  s.push(10, {0, 0, 1});
  const std::vector<float> start = s.positions;
  Guard guard = s.guard({.outside = Outside::keep});
  EXPECT_EQ(guard.start().outside.size(), 6u);
  s.push(10, {0, 0, 0.01});
  s.push(700, {0, 0, 0.01});
  s.correct(guard.constrain(s.positions));
  EXPECT_EQ(std::memcmp(&s.positions[30], &start[30], 12), 0) << "stays";
  EXPECT_NE(std::memcmp(&s.positions[2100], &start[2100], 12), 0) << "moves";
}

TEST(Guard, ResetStartsAnew) {
  Sculpture s;
  Guard guard = s.guard();
  const std::vector<float> start = s.positions;
  s.dab(100, 0.5, 0.02);
  guard.reset(s.positions);
  const dvec3 good = s.at(100);
  s.push(100, {0, 0, 5});
  s.correct(guard.constrain(s.positions));
  EXPECT_NEAR(s.at(100).x, good.x, 1e-6) << "from the new state";
}

/// A square that is bent along its diagonal 0-2 by `bend`, cut along that diagonal and along the other one.
TriangleMesh square(double bend, bool is_cut_otherwise = false) {
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, bend}}, {}};
  mesh.triangles.assign({{0, 1, 2}, {0, 2, 3}});
  if (is_cut_otherwise) mesh.triangles.assign({{0, 1, 3}, {1, 2, 3}});
  return mesh;
}

TEST(Guard, ReplacedFacesAreKeptFromThenOn) {
  Sculpture s(square(0));
  Guard guard = s.guard();
  s.mesh = square(0, true);
  ASSERT_TRUE(guard.replace_faces(s.faces()).empty());
  // Cut along this diagonal, a raised corner lifts the middle; cut along the other one, it does not.
  const TriangleMesh reference = square(0);
  s.push(1, {0, 0, 0.5}), s.push(3, {0, 0, 0.5});
  s.correct(guard.constrain(s.positions));
  TriangleMesh now = s.mesh;
  for (std::size_t v = 0; v < 4; ++v) now.vertices[v] = s.at(v);
  const double upper = std::max(hausdorff(now, reference, {kTolerance, 1, nullptr}).upper,
                                hausdorff(reference, now, {kTolerance, 1, nullptr}).upper);
  EXPECT_LE(upper, kTolerance);
  EXPECT_GT(upper, 0.9 * kTolerance);
}

TEST(Guard, FacesThatAreOutsideOrLeaveTheReferenceUncoveredAreNotTaken) {
  // The middle of the other diagonal is half of the bend above that of this one.
  for (const bool two_sided : {false, true}) {
    Sculpture near(square(0.8 * kTolerance)), far(square(8 * kTolerance));
    EXPECT_TRUE(near.guard({.two_sided = two_sided}).replace_faces(shapes::indices(square(0, true))).empty());
    Guard guard = far.guard({.two_sided = two_sided});
    EXPECT_EQ(guard.replace_faces(shapes::indices(square(0, true))), (std::vector<std::uint32_t>{0, 1}));
    far.push(3, {0, 0, 0.5});
    far.correct(guard.constrain(far.positions));
    EXPECT_LE(far.deviation(), kTolerance) << "it goes on with the faces from before";
  }
  // Two faces on one another cover the reference no longer, although both are inside.
  Sculpture s(square(0));
  const std::vector<std::uint32_t> twice{0, 1, 2, 0, 1, 2};
  EXPECT_TRUE(s.guard({.two_sided = false}).replace_faces(twice).empty());
  EXPECT_EQ(s.guard().replace_faces(twice), (std::vector<std::uint32_t>{1}));
}

TEST(Guard, ReplacedFacesPollOftenAndAreAsBeforeOnceCancelled) {
  const unsigned n = 100;
  Sculpture s(shapes::grid(n));
  std::vector<std::uint32_t> otherwise;
  for (unsigned i = 0; i < n; ++i) {
    for (unsigned j = 0; j < n; ++j) {
      const unsigned a = i * (n + 1) + j, b = a + n + 1;
      otherwise.insert(otherwise.end(), {a, b, a + 1, b, b + 1, a + 1});
    }
  }
  Guard guard = s.guard({.crossings = PullBack::Crossings::keep_out});
  std::size_t polls = polls_of([&] { ASSERT_TRUE(guard.replace_faces(otherwise).empty()); });
  EXPECT_GE(polls, 2 * n * n) << "each face is searched for crossings";
  for (const std::size_t share : {10, 2}) {
    {
      const Counted cancelled(polls / share);
      EXPECT_THROW(guard.replace_faces(s.faces()), Cancelled);
    }
    EXPECT_TRUE(guard.replace_faces(otherwise).empty());
    EXPECT_TRUE(guard.constrain(s.positions).vertices.empty()) << "the state is the same";
  }
  ASSERT_TRUE(guard.replace_faces(s.faces()).empty());
  s.push((n / 2) * (n + 1) + n / 2, {0, 0, 1});
  s.correct(guard.constrain(s.positions));
  EXPECT_LE(s.deviation(), kTolerance);
  EXPECT_GT(s.deviation(), 0.9 * kTolerance);
}

TEST(Guard, FacesThatTurnOverOrCrossAreNotTaken) {
  Sculpture s(square(0));
  const std::vector<std::uint32_t> turned{0, 2, 1, 0, 2, 3};
  EXPECT_EQ(s.guard().replace_faces(turned), (std::vector<std::uint32_t>{0}));
  EXPECT_TRUE(s.guard({.max_normal_angle = 180}).replace_faces(turned).empty());
  // A needle through the middle of the other diagonal, which does not reach this one.
  TriangleMesh mesh = square(0.8 * kTolerance);
  const double z = 0.2 * kTolerance;
  for (const dvec3& p : {dvec3(0.45, 0.5, z), {0.55, 0.5, z}, {0.5, 0.5, 3 * z}}) mesh.vertices.push_back(p);
  mesh.triangles.emplace_back(4, 5, 6);
  Sculpture pierced(mesh);
  TriangleMesh otherwise = mesh;
  otherwise.triangles[0] = {0, 1, 3}, otherwise.triangles[1] = {1, 2, 3};
  EXPECT_TRUE(pierced.guard().replace_faces(shapes::indices(otherwise)).empty());
  Guard guard = pierced.guard({.crossings = PullBack::Crossings::keep_out});
  EXPECT_FALSE(guard.replace_faces(shapes::indices(otherwise)).empty());
  // The boxes of the faces from before are looked at again: the needle may not go down through them.
  pierced.push(4, {0, 0, -2 * z}), pierced.push(5, {0, 0, -2 * z});
  EXPECT_FALSE(guard.constrain(pierced.positions).vertices.empty());
}

TEST(Guard, ReplacedFacesMayCrossOnlyWhatTheyCrossThen) {
  // At the start the other triangulation would cross the needle, but it is not there then.
  const double h = 0.2 * kTolerance;
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 2 * h}, {1, 1, 0}, {0, 1, 2 * h}}, {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}}};
  for (const dvec3& p : {dvec3(0.48, 0.5, h), {0.52, 0.5, h}, {0.5, 0.5, 3 * h}}) mesh.vertices.push_back(p);
  Sculpture s(mesh);
  Guard guard = s.guard({.crossings = PullBack::Crossings::keep_out});
  s.push(1, {0, 0, -2 * h}), s.push(3, {0, 0, -2 * h});
  ASSERT_TRUE(guard.constrain(s.positions).vertices.empty());
  ASSERT_TRUE(guard.replace_faces({0, 1, 3, 1, 2, 3, 4, 5, 6}).empty());
  s.push(1, {0, 0, 2 * h}), s.push(3, {0, 0, 2 * h});
  s.correct(guard.constrain(s.positions));
  EXPECT_LT(s.at(1).z + s.at(3).z, 2 * h);
}

TEST(Guard, FacesThatKeepLessThanOthersAreNotReplaced) {
  // A corner that is repeated has no triangle, so that nothing is kept of one.
  Sculpture s(square(0));
  Guard triangle(s.positions, {0, 1, 2, 2}, 4, s.to_world, s.volume, {.two_sided = false});
  EXPECT_THROW(triangle.replace_faces({0, 1, 2, 3}), InvalidInput);
  EXPECT_TRUE(triangle.replace_faces({0, 1, 3, 3}).empty());
  // One triangle of a quad with three corners in a line has no normal.
  s.push(1, {-0.5, 0.5, 0});
  Guard quad(s.positions, {0, 1, 2, 3}, 4, s.to_world, s.volume, {.two_sided = false});
  s.push(1, {0.5, -0.5, 0});
  ASSERT_TRUE(quad.constrain(s.positions).vertices.empty());
  EXPECT_EQ(quad.replace_faces({1, 2, 3, 0}), (std::vector<std::uint32_t>{0}));
}

TEST(Guard, WhatIsNearestToAnUncoveredPartIsNotReplaced) {
  // The square has a part beside it that only the reference has.
  TriangleMesh reference = square(0);
  for (const dvec3& p : {dvec3(2, 0, 0), {2, 1, 0}}) reference.vertices.push_back(p);
  reference.triangles.emplace_back(1, 4, 5), reference.triangles.emplace_back(1, 5, 2);
  Sculpture s(reference);
  Guard guard(s.positions, shapes::indices(square(0)), 3, s.to_world, s.volume, {.outside = Outside::keep});
  ASSERT_GT(guard.start().uncovered.faces, 0u);
  EXPECT_FALSE(guard.replace_faces(shapes::indices(square(0, true))).empty());
}

TEST(Guard, BadFacesKeepTheFaces) {
  Sculpture s(square(0));
  Guard guard = s.guard();
  EXPECT_THROW(guard.replace_faces({0, 1, 2}), InvalidInput);
  EXPECT_THROW(guard.replace_faces({0, 1, 2, 0, 2, 4}), InvalidInput);
  Progress cancelled;
  cancelled.cancel();
  EXPECT_THROW(guard.replace_faces(shapes::indices(square(0, true)), &cancelled), Cancelled);
  s.push(1, {0, 0, 0.5}), s.push(3, {0, 0, 0.5});
  s.correct(guard.constrain(s.positions));
  EXPECT_LE(s.deviation(), kTolerance);
}

}  // namespace
