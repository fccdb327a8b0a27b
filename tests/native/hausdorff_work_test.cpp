// SPDX-License-Identifier: GPL-3.0-or-later
// How much work a measurement takes, counted by its polls.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "base/call.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "measures.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using namespace tolvol::measures;

TEST(Hausdorff, NoDistanceEndsAtRounding) {
  shapes::Random random(3);
  TriangleMesh rough = sphere(60, 1);
  for (dvec3& p : rough.vertices) p += 0.01 * random.point();
  const TriangleMesh fine = subdivided(rough);
  const auto turn = [](const dvec3& p) { return dvec3(0.36 * p.x - 0.8 * p.y, 0.48 * p.x + 0.6 * p.y, 0.8 * p.x); };
  const std::size_t polls = polls_of([&] {
    EXPECT_LT(measured(rough, rough).upper, 1e-14);
    EXPECT_LT(measured(fine, rough).upper, 1e-14);
    EXPECT_LT(measured(rough, fine).upper, 2e-14);
    EXPECT_LT(measured(shapes::squares(1, turn), shapes::squares(60, turn)).upper,
              2e-14);  // two triangles over 7,200 in their oblique plane
  });
  EXPECT_LT(polls, 20'000u);
}

/// The polls of a measurement on this thread, a measure of its work.
std::size_t polls_of(const TriangleMesh& a, const TriangleMesh& b) {
  std::size_t polls = 0;
  const Call call(nullptr, [&] {
    ++polls;
    return false;
  });
  const HausdorffInterval h = hausdorff(a, b, {.threads = 1});
  EXPECT_LE(h.upper - h.lower, std::max(0.001 * h.upper, 1e-13));
  return polls;
}

// A segment under n equal peaks takes pieces in proportion to n, also where it is a triangle of three distinct corners.
TEST(Hausdorff, OutlinesTakeWorkInProportion) {
  for (const double turn : {0.0, 0.3}) {
    for (const double middle : {0.0, 0.1}) {
      std::array<std::size_t, 2> polls{};
      for (const unsigned n : {250u, 1000u}) {
        const auto at = [&](double x, double y) {
          return dvec3(x * std::cos(turn) - y * std::sin(turn), x * std::sin(turn) + y * std::cos(turn), 0.3 * x);
        };
        TriangleMesh zigzag;
        for (unsigned i = 0; i <= 2 * n; ++i) zigzag.vertices.push_back(at(i / (2.0 * n), i % 2));
        for (unsigned i = 0; i < 2 * n; ++i) zigzag.triangles.emplace_back(i, i + 1, i);
        const TriangleMesh base{{at(0, 0), at(1, 0), at(middle, 0)}, {{0, 1, 2}}};
        polls[n == 1000] = polls_of(base, zigzag);
      }
      EXPECT_LT(polls[1], 6 * polls[0]) << turn << ' ' << middle;
      EXPECT_LT(polls[1], 2000u) << turn << ' ' << middle;
    }
  }
}

// A straight line that is cut at other places is cut once at each of them, and not halved until the parts are rounding.
TEST(Hausdorff, StraightOutlinesTakeFewPiecesForEachCut) {
  shapes::Random random(5);
  const auto line = [&](unsigned cuts, unsigned third) {
    std::vector<double> at{0, 1};
    for (unsigned i = 0; i < cuts; ++i) at.push_back(random.share());
    std::sort(at.begin(), at.end());
    TriangleMesh mesh;
    for (const double x : at) mesh.vertices.push_back(x * dvec3(1, 0.3, -0.7));
    for (unsigned i = 0; i <= cuts; ++i) mesh.triangles.emplace_back(i, i + 1, third == 0 ? i : i + 1);
    return mesh;
  };
  for (const unsigned third : {0u, 1u}) {
    std::array<std::size_t, 2> polls{};
    for (const unsigned n : {2000u, 8000u}) {
      const TriangleMesh a = line(n, third), b = line(n, third), one = line(0, third);
      for (const auto& [from, to] : {std::pair{a, b}, {one, b}, {b, one}}) polls[n == 8000] += polls_of(from, to);
    }
    EXPECT_LT(polls[1], 6 * polls[0]) << third;
    EXPECT_LT(polls[1], 6000u) << third;
  }
}

// All triangles of a fan meet in one point, and the boxes of most of them hold any point near the middle.
TEST(Hausdorff, FansTakeLittleForEachTriangle) {
  shapes::Random random(12);
  const unsigned n = 6000;
  TriangleMesh fan;
  for (unsigned i = 0; i < n; ++i) {
    const double angle = 2 * M_PI * i / n;
    fan.vertices.emplace_back(std::cos(angle), 0.8 * std::sin(angle), 0.6 * std::sin(angle));
    fan.triangles.emplace_back(i, (i + 1) % n, n);
  }
  fan.vertices.emplace_back(0, 0, 0);
  TriangleMesh moved = fan;
  for (unsigned i = 0; i < n; ++i) moved.vertices[i] += 1e-3 * random.point();
  for (const auto& [a, b] : {std::pair{fan, fan}, {moved, fan}, {fan, moved}}) EXPECT_LT(polls_of(a, b), 1000u);
}

// Two fans whose common corners are at nearly the same place. Every search near the corner that all triangles share may
// look at all of them, so that each of its pieces takes as much as hundreds of others.
TEST(Hausdorff, PiecesAtACornerThatVeryManyShareCountForSeveral) {
  constexpr unsigned kFaces = many(4000);
  TriangleMesh one;
  for (unsigned i = 0; i <= kFaces; ++i) {
    const double angle = 2 * std::numbers::pi * i / kFaces, x = std::cos(angle), y = std::sin(angle);
    one.vertices.push_back(i == kFaces ? dvec3(0) : dvec3(0.36 * x - 0.8 * y, 0.48 * x + 0.6 * y, 0.8 * x));
    if (i < kFaces) one.triangles.emplace_back(kFaces, i, (i + 1) % kFaces);
  }
  TriangleMesh other = one;
  other.vertices.back() += dvec3(8e-11, 5e-11, -3e-11);
  HausdorffInterval found{};
  EXPECT_LT(tolvol::polls_of([&] { found = hausdorff(one, other, {.threads = 1}); }), 3000u);
  EXPECT_LT(found.upper, 1e-9);
}

}  // namespace
