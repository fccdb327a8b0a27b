// SPDX-License-Identifier: GPL-3.0-or-later
// No new crossings in decimation. Meshes whose sides are nearer to each other than the tolerance get hundreds of them
// where crossings are allowed. Results are judged by CGAL, and by measure/hausdorff.h for the distance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "crossing_judge.h"
#include "decimation_cases.h"
#include "many.h"
#include "shapes.h"
#include "topology/crossings.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::expect_within;
using cases::run;
using glm::dvec3;
using Options = DecimationOptions;

std::size_t count(const std::vector<dvec3>& vertices, const std::vector<glm::uvec3>& triangles) {
  Team team(2);
  return crossings(vertices, triangles, std::size_t{1} << 30, team, nullptr).pairs.size();
}

TriangleMesh moved(TriangleMesh mesh, const glm::dmat4& by) {
  for (dvec3& p : mesh.vertices) p = dvec3(by * glm::dvec4(p, 1));
  return shapes::stored(mesh);
}

Options allow() {
  Options options;
  options.crossings = Options::Crossings::allow;
  return options;
}

/// A hollow sphere.
TriangleMesh hollow(unsigned n, double wall) {
  return shapes::stored(shapes::joined(shapes::sphere(n), shapes::turned(shapes::sphere(n, 1 - wall))));
}

/// Two rings through each other, `apart` where they are nearest.
TriangleMesh links(double apart) {
  const glm::dmat4 other({1, 0, 0, 0}, {0, 0, 1, 0}, {0, -1, 0, 0}, {1.2 - apart, 0, 0, 1});
  return shapes::joined(shapes::torus(24), moved(shapes::torus(24), other));
}

/// A sheet rolled up, with layers so far apart.
TriangleMesh roll(double apart) {
  // An even number, so that the layers have their edges above each other.
  return shapes::stored(shapes::squares(2 * across(25), [&](const dvec3& p) {
    const double turns = 2 * p.x, radius = 0.5 + apart * turns, angle = 2 * std::numbers::pi * turns;
    return dvec3(radius * std::cos(angle), radius * std::sin(angle), p.y);
  }));
}

/// Rings in a row, each through the next.
TriangleMesh chain(unsigned rings) {
  TriangleMesh ring = shapes::torus(20), all;
  for (dvec3& p : ring.vertices) {
    const dvec3 centre = glm::normalize(dvec3(p.x, p.y, 0));
    p = centre + 0.3 * (p - centre);
  }
  for (unsigned i = 0; i < rings; ++i) {
    const double s = i % 2;
    all = shapes::joined(all, moved(ring, {{1, 0, 0, 0}, {0, 1 - s, s, 0}, {0, -s, 1 - s, 0}, {1.7 * i, 0, 0, 1}}));
  }
  return all;
}

constexpr std::size_t kThinShapes = 3;

/// One of each shape, and after these the shapes that differ in a number alone.
std::vector<Case> thin() {
  std::vector<Case> all{{hollow(8, 0.01)}, {links(1e-3)}, {roll(0.01)}};
  if (!kSanitized) all.insert(all.end(), {{hollow(8, 0.002)}, {hollow(8, 0.03)}});
  for (Case& c : all) c.percent = 2;
  return all;
}

TEST(DecimationCrossings, ThinWallsDoNotCross) {
  std::size_t allowed = 0;
  const std::vector<Case> all = thin();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Case& c = all[i];
    ASSERT_EQ(count(c.mesh.vertices, c.mesh.triangles), 0u);
    for (const auto effort : {Options::Effort::fast, Options::Effort::thorough}) {
      for (const auto placement : {Options::Placement::optimal, Options::Placement::subset}) {
        // Thorough with original positions alone makes the same tries, at less than all places.
        const bool is_like_others = placement == Options::Placement::subset || i >= kThinShapes || kSanitized;
        if (effort == Options::Effort::thorough && is_like_others && !is_full_run()) continue;
        Options options;
        options.effort = effort, options.placement = placement;
        const DecimationResult r = run(c, options);
        EXPECT_TRUE(crossings_by_cgal({r.vertices, r.triangles}).empty());
        EXPECT_LT(r.triangles.size(), c.mesh.triangles.size() / 4);
        expect_within(c, r);
      }
    }
    const DecimationResult r = run(c, allow());
    allowed += count(r.vertices, r.triangles);
  }
  EXPECT_GT(allowed, 100u) << "the meshes show nothing";
}

// The sheets of a wall would meet in most steps of thorough if it did not hold each on its side of the other: it left
// 134 and 224 triangles then, hardly fewer than fast.
TEST(DecimationCrossings, ThoroughKeepsSheetsApart) {
  struct Golden {
    double wall, percent;
    std::size_t most;
  };
  Options thorough;
  thorough.effort = Options::Effort::thorough;
  for (const auto& [wall, percent, most] : {Golden{0.03, 3, 110}, Golden{0.02, 2, 160}}) {
    Case c{hollow(across(10), wall)};
    c.percent = percent;
    const DecimationResult r = run(c, thorough);
    EXPECT_LE(r.triangles.size(), most) << "wall " << wall;
    EXPECT_TRUE(crossings_by_cgal({r.vertices, r.triangles}).empty());
    expect_within(c, r);
    if (kSanitized) break;
  }
}

TEST(DecimationCrossings, OptionsDoNotChangeThePromise) {
  Case c{hollow(across(10), 0.01)};
  std::vector<Options> all(4);
  all[0].two_sided = false;
  all[1].target_triangles = 500;
  all[2].effort = Options::Effort::thorough, all[2].max_seconds = 0.3;
  const std::vector<double> shares(c.mesh.vertices.size(), 0.6);
  all[3].shares = shares;
  for (const Options& options : all) {
    const DecimationResult r = run(c, options);
    EXPECT_TRUE(crossings_by_cgal({r.vertices, r.triangles}).empty());
    expect_within(c, r, options.two_sided);
  }
}

// The predicates are asked about what is stored, so the matrix changes nothing about them.
TEST(DecimationCrossings, AnyMatrixAndStorage) {
  glm::dmat4 sheared(1), mirrored(1), far_away(1);
  sheared[1][0] = 0.7, sheared[2][1] = -0.4, sheared[0][0] = 3;
  mirrored[0][0] = -1;
  far_away[3] = {5000, -3000, 100, 1};
  for (const glm::dmat4& to_world : {sheared, mirrored, far_away}) {
    for (const Storage storage : {Storage::float32, Storage::float64}) {
      if (kSanitized && (storage == Storage::float32) == (to_world == mirrored)) continue;  // one for each matrix
      const Case c{hollow(6, 0.01), to_world, storage, 2};
      const DecimationResult r = run(c);
      EXPECT_TRUE(crossings_by_cgal({r.vertices, r.triangles}).empty());
      EXPECT_LT(r.triangles.size(), c.mesh.triangles.size() / 2);
      expect_within(c, r);
    }
  }
}

// Large enough for regions that are worked on side by side.
TEST(DecimationCrossings, TheSameBitsForAnyNumberOfThreads) {
  const Case regions{hollow(many(16), 0.01)};
  cases::expect_same_bits(regions, {}, {4});
  Options thorough;
  thorough.effort = Options::Effort::thorough;
  Case few{hollow(across(8), 0.02)};
  few.percent = 3;
  cases::expect_same_bits(few, thorough);
  // Where faces cross already, tries also read which input faces others stand for.
  const Case crossing{shapes::joined(shapes::torus(many(40)), moved(shapes::torus(many(32)), glm::dmat4(0.98)))};
  ASSERT_GT(count(crossing.mesh.vertices, crossing.mesh.triangles), 100u);
  cases::expect_same_bits(crossing, {});
}

TEST(DecimationCrossings, AChainStaysLinked) {
  const Case c{chain(5)};
  ASSERT_EQ(count(c.mesh.vertices, c.mesh.triangles), 0u);
  const DecimationResult r = run(c);
  EXPECT_TRUE(crossings_by_cgal({r.vertices, r.triangles}).empty());
  expect_within(c, r);
}

// What crosses in the input goes on to cross, and the number of pairs does not rise.
TEST(DecimationCrossings, TheirNumberNeverRises) {
  std::size_t before = 0, after = 0;
  for (unsigned seed = 0; seed < 3; ++seed) {
    shapes::Random random(seed);
    TriangleMesh rough = shapes::joined(
        shapes::torus(24),
        moved(shapes::torus(20), glm::dmat4({0.9, 0.1, 0, 0}, {0, 1, 0.2, 0}, {0.1, 0, 1, 0}, {0.01, 0.02, 0, 1})));
    for (dvec3& p : rough.vertices) p += 0.004 * (seed + 1) * random.point();
    Case c{shapes::stored(rough)};
    const std::size_t of_input = count(c.mesh.vertices, c.mesh.triangles);
    for (const auto effort : {Options::Effort::fast, Options::Effort::thorough}) {
      if (effort == Options::Effort::thorough && (seed > 0 || kSanitized) && !is_full_run()) continue;
      Options options;
      options.effort = effort;
      c.percent = effort == Options::Effort::thorough ? 2 : 1;  // Thorough takes longer the more triangles are left.
      const DecimationResult r = run(c, options);
      const std::size_t of_result = count(r.vertices, r.triangles);
      EXPECT_LE(of_result, of_input) << "seed " << seed;
      before += of_input, after += of_result;
      expect_within(c, r);
    }
  }
  EXPECT_GT(before, 500u);
  EXPECT_GT(after, 0u);
}

// Leaf cards: two sheets with vertices of their own on the same positions.
TEST(DecimationCrossings, DoubleSheetsStillCollapse) {
  const TriangleMesh sheet =
      shapes::stored(shapes::squares(24, [](const dvec3& p) { return dvec3(p.x, p.y, 0.02 * std::sin(5 * p.x)); }));
  const Case c{shapes::joined(sheet, shapes::turned(sheet))};
  const DecimationResult r = run(c);
  EXPECT_LT(r.triangles.size(), 200u);
  expect_within(c, r);
  const auto counted = std::ranges::find(r.repairs, "double_sheet", &Repair::kind);
  ASSERT_NE(counted, r.repairs.end());
  EXPECT_EQ(counted->count, c.mesh.triangles.size());
  const DecimationResult of_one = run(Case{sheet});
  EXPECT_EQ(std::ranges::find(of_one.repairs, "double_sheet", &Repair::kind), of_one.repairs.end());
}

// Faces that no manifold holds are in the way like any others.
TEST(DecimationCrossings, SoupsAndJoinedSheets) {
  int number = 0;
  for (const Case& c : cases::all()) {
    const std::size_t before = count(c.mesh.vertices, c.mesh.triangles);
    const DecimationResult r = run(c);
    EXPECT_LE(count(r.vertices, r.triangles), before) << "case " << number;
    ++number;
  }
}

}  // namespace
