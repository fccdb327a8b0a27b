// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/close_holes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <set>

#include "base/errors.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "polls.h"
#include "shapes.h"
#include "topology/crossings.h"
#include "topology/sides.h"
#include "topology/solidity.h"
#include "without.h"

namespace {

using namespace tolvol;
using glm::dvec3;

const StoredSpace kSpace(glm::dmat4(1), Storage::float64);

std::unique_ptr<ToleranceVolume> volume_of(const TriangleMesh& mesh, double tolerance) {
  return std::make_unique<ToleranceVolume>(mesh.vertices, mesh.triangles, kSpace, tolerance);
}

HoleClosingResult close(const TriangleMesh& mesh, double tolerance, const CloseHolesOptions& options = {}) {
  return close_holes(mesh.vertices, mesh.triangles, kSpace, *volume_of(mesh, tolerance), options);
}

Solidity solidity_of(const TriangleMesh& mesh) {
  Team team(1);
  return solidity(mesh.vertices, mesh.triangles, team);
}

/// The mesh without triangles that run through the same three places as an earlier one in the same direction.
TriangleMesh each_once(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> place = weld_equal_positions(mesh.vertices);
  std::set<std::array<std::uint32_t, 3>> seen;
  return without(mesh, [&](unsigned t) {
    const glm::uvec3& c = mesh.triangles[t];
    std::array<std::uint32_t, 3> at{place[c.x], place[c.y], place[c.z]};
    std::rotate(at.begin(), std::min_element(at.begin(), at.end()), at.end());
    return !seen.insert(at).second;
  });
}

/// Judges by what close_holes() does not use that the result keeps its promises about a mesh and a reference.
void judge(const TriangleMesh& mesh, const TriangleMesh& reference, const HoleClosingResult& result, double tolerance) {
  const std::size_t before = mesh.triangles.size(), added = result.triangles.size() - before;
  ASSERT_TRUE(std::equal(mesh.triangles.begin(), mesh.triangles.end(), result.triangles.begin()));
  ASSERT_EQ(result.loop.size(), added);
  ASSERT_EQ(result.borders.size(), added);
  ASSERT_EQ(result.corner_source.size(), added);
  const TriangleMesh closed{mesh.vertices, result.triangles};
  if (added > 0) {
    const TriangleMesh only_new{mesh.vertices,
                                {result.triangles.begin() + std::ptrdiff_t(before), result.triangles.end()}};
    EXPECT_LE(hausdorff(only_new, reference, {.bound = tolerance}).upper, tolerance);
  }
  Team team(1);
  for (const glm::uvec2& pair :
       crossings(closed.vertices, closed.triangles, std::numeric_limits<std::size_t>::max(), team, nullptr).pairs) {
    EXPECT_LT(pair.y, before) << "a new face crosses another one";
  }
  const Solidity was = solidity_of(each_once(mesh)), is = solidity_of(each_once(closed));
  EXPECT_EQ(is.non_manifold_edges, was.non_manifold_edges);
  EXPECT_EQ(is.misoriented_edges, was.misoriented_edges);
  EXPECT_EQ(is.degenerate_triangles, was.degenerate_triangles);
  std::size_t filled_edges = 0, triangles = 0;
  for (const HoleClosingResult::Loop& loop : result.loops) {
    if (loop.outcome == LoopOutcome::closed) filled_edges += loop.corners, triangles += loop.corners - 2;
  }
  EXPECT_EQ(is.open_edges + filled_edges, was.open_edges);
  EXPECT_EQ(added, triangles);
  const auto at = [&](std::uint32_t corner) { return mesh.vertices[result.triangles[corner / 3][int(corner % 3)]]; };
  std::size_t at_rim = 0;
  for (std::size_t f = 0; f < added; ++f) {
    const auto first = std::uint32_t(3 * (before + f));
    EXPECT_EQ(result.loops[result.loop[f]].outcome, LoopOutcome::closed);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t source = result.corner_source[f][int(k)], other = result.borders[f][int(k)];
      EXPECT_EQ(at(source), at(first + k));
      if (other == HoleClosingResult::kNone) continue;
      ++at_rim;
      bool runs_against = false;
      for (std::uint32_t side = 3 * other; side < 3 * other + 3; ++side) {
        runs_against |= at(side) == at(first + (k + 1) % 3) && at(next_corner(side)) == at(first + k);
      }
      EXPECT_TRUE(runs_against);
      EXPECT_TRUE(result.corner_source[f][int(k)] / 3 == other || result.borders[f][int((k + 2) % 3)] == source / 3);
    }
  }
  EXPECT_EQ(at_rim, filled_edges);
}

void judge(const TriangleMesh& mesh, const HoleClosingResult& result, double tolerance) {
  judge(mesh, mesh, result, tolerance);
}

std::vector<LoopOutcome> outcomes(const HoleClosingResult& result) {
  std::vector<LoopOutcome> found;
  for (const HoleClosingResult::Loop& loop : result.loops) found.push_back(loop.outcome);
  return found;
}

using Outcomes = std::vector<LoopOutcome>;

/// A tube of `n` sides about the z axis.
TriangleMesh tube(unsigned n, double radius, double length, unsigned rings) {
  TriangleMesh mesh;
  for (unsigned k = 0; k <= rings; ++k) {
    for (unsigned i = 0; i < n; ++i) {
      const double a = 2 * std::numbers::pi * i / n;
      mesh.vertices.emplace_back(radius * std::cos(a), radius * std::sin(a), length * k / rings);
    }
  }
  for (unsigned k = 0; k < rings; ++k) {
    for (unsigned i = 0; i < n; ++i) {
      const unsigned a = k * n + i, b = k * n + (i + 1) % n;
      mesh.triangles.emplace_back(a, b, b + n);
      mesh.triangles.emplace_back(a, b + n, a + n);
    }
  }
  return mesh;
}

/// The grid with noise, without the squares for which drop(i, j) holds.
template <class Drop>
TriangleMesh plate(unsigned n, double noise, Drop&& drop) {
  shapes::Random random(2);
  TriangleMesh mesh = shapes::grid(n);
  for (dvec3& p : mesh.vertices) p.z = noise * random.point().x;
  return without(mesh, [&](unsigned t) { return drop(t / 2 / n, t / 2 % n); });
}

TEST(CloseHoles, AHoleOfOneTriangleGetsThatTriangle) {
  const TriangleMesh whole = shapes::torus(24), mesh = without(whole, [](unsigned t) { return t == 700; });
  const HoleClosingResult result = close(mesh, 0.05);
  judge(mesh, result, 0.05);
  ASSERT_EQ(outcomes(result), Outcomes{LoopOutcome::closed});
  glm::uvec3 missing = whole.triangles[700], found = result.triangles.back();
  while (missing.x != found.x) missing = {missing.y, missing.z, missing.x};
  EXPECT_EQ(missing, found);
  EXPECT_TRUE(solidity_of({mesh.vertices, result.triangles}).closed());
}

TEST(CloseHoles, AHoleIsClosedExactlyWithinTheToleranceThatItNeeds) {
  // The middle of a missing square of a plate is half its width from the rim.
  const double width = 0.1;
  const TriangleMesh mesh = plate(10, 0, [](unsigned i, unsigned j) { return i == 4 && j == 4; });
  for (const auto& [tolerance, expected] : {std::pair(0.501 * width, true), {0.499 * width, false}}) {
    const HoleClosingResult result = close(mesh, tolerance);
    judge(mesh, result, tolerance);
    ASSERT_EQ(result.loops.size(), 2u);  // the first is the border of the plate
    EXPECT_EQ(result.loops[0].outcome, LoopOutcome::turned);
    EXPECT_EQ(result.loops[1].outcome, expected ? LoopOutcome::closed : LoopOutcome::outside);
  }
}

TEST(CloseHoles, TellsWhereALoopIs) {
  TriangleMesh mesh = plate(10, 0, [](unsigned i, unsigned j) { return i == 4 && j == 2; });
  glm::dmat4 to_world(2);
  to_world[3] = {100, 0, 0, 1};
  const StoredSpace space(to_world, Storage::float64);
  const ToleranceVolume volume(mesh.vertices, mesh.triangles, space, 0.15);
  const HoleClosingResult result = close_holes(mesh.vertices, mesh.triangles, space, volume);
  ASSERT_EQ(result.loops.size(), 2u);
  EXPECT_EQ(result.loops[1].outcome, LoopOutcome::closed);
  EXPECT_EQ(result.loops[1].corners, 4u);
  EXPECT_NEAR(result.loops[1].perimeter, 0.8, 1e-12);
  EXPECT_NEAR(glm::length(result.loops[1].centre - dvec3(100.9, 0.5, 0)), 0, 1e-12);
  EXPECT_NEAR(glm::length(mesh.vertices[result.loops[1].vertex] - dvec3(0.45, 0.25, 0)), 0.05 * std::sqrt(2), 1e-12);
}

TEST(CloseHoles, LongerLoopsThanTheLargestPerimeterStayOpen) {
  const TriangleMesh mesh =
      plate(20, 0.002, [](unsigned i, unsigned j) { return (i == 4 && j == 4) || (i == 12 && (j == 12 || j == 13)); });
  CloseHolesOptions options;
  const HoleClosingResult all = close(mesh, 0.05);
  ASSERT_EQ(all.loops.size(), 3u);
  EXPECT_NE(all.loops[0].outcome, LoopOutcome::closed);  // the border of the plate
  EXPECT_EQ(all.loops[1].outcome, LoopOutcome::closed);
  EXPECT_EQ(all.loops[2].outcome, LoopOutcome::closed);
  options.largest_perimeter = 0.25;
  const HoleClosingResult result = close(mesh, 0.05, options);
  EXPECT_EQ(outcomes(result), (Outcomes{LoopOutcome::perimeter, LoopOutcome::closed, LoopOutcome::perimeter}));
  judge(mesh, result, 0.05);
}

TEST(CloseHoles, TheEndsOfATubeThinnerThanTheToleranceCloseUnlessTheyAreTooLong) {
  const TriangleMesh mesh = tube(12, 0.02, 1, 10);
  const HoleClosingResult result = close(mesh, 0.03);
  judge(mesh, result, 0.03);
  EXPECT_EQ(outcomes(result), (Outcomes{LoopOutcome::closed, LoopOutcome::closed}));
  EXPECT_TRUE(solidity_of({mesh.vertices, result.triangles}).closed());
  CloseHolesOptions options;
  options.largest_perimeter = 0.1;
  EXPECT_EQ(outcomes(close(mesh, 0.03, options)), (Outcomes{LoopOutcome::perimeter, LoopOutcome::perimeter}));
  // One that is wider stays open.
  EXPECT_EQ(outcomes(close(mesh, 0.015)), (Outcomes{LoopOutcome::outside, LoopOutcome::outside}));
}

TEST(CloseHoles, NoSheetGetsABackUnlessAnyAngleIsPermitted) {
  TriangleMesh mesh = shapes::grid(4);
  for (dvec3& p : mesh.vertices) p.z = 0.2 * (p.x * (1 - p.x) + p.y * (1 - p.y));  // a dome, its rim not in a plane
  CloseHolesOptions options;
  EXPECT_EQ(outcomes(close(mesh, 0.2, options)), Outcomes{LoopOutcome::turned});
  options.max_normal_angle = 180;
  const HoleClosingResult result = close(mesh, 0.2, options);
  judge(mesh, result, 0.2);
  EXPECT_EQ(outcomes(result), Outcomes{LoopOutcome::closed});
  EXPECT_TRUE(solidity_of({mesh.vertices, result.triangles}).closed());
}

TEST(CloseHoles, ARimThatLooksAgainstItsReferenceIsClosedAsTheRimLooks) {
  const TriangleMesh reference = shapes::torus(24);
  const TriangleMesh mesh = shapes::turned(without(reference, [](unsigned t) { return t == 700 || t == 701; }));
  const auto volume = volume_of(reference, 0.05);
  const HoleClosingResult result = close_holes(mesh.vertices, mesh.triangles, kSpace, *volume);
  judge(mesh, reference, result, 0.05);
  EXPECT_EQ(outcomes(result), Outcomes{LoopOutcome::closed});
}

TEST(CloseHoles, OfAPlaneHoleTheTrianglesAreSound) {
  // The rim has points on straight lines, and no triangle may lie on one.
  const TriangleMesh mesh = plate(20, 0, [](unsigned i, unsigned j) { return i >= 5 && i < 10 && j >= 5 && j < 9; });
  const HoleClosingResult result = close(mesh, 0.11);
  judge(mesh, result, 0.11);
  EXPECT_EQ(outcomes(result), (Outcomes{LoopOutcome::turned, LoopOutcome::closed}));
  double area = 0;
  for (std::size_t t = mesh.triangles.size(); t < result.triangles.size(); ++t) {
    const glm::uvec3& c = result.triangles[t];
    const dvec3 n = glm::cross(mesh.vertices[c.y] - mesh.vertices[c.x], mesh.vertices[c.z] - mesh.vertices[c.x]);
    EXPECT_GT(n.z, 0);
    area += n.z / 2;
  }
  EXPECT_NEAR(area, 0.05, 1e-12);
}

TEST(CloseHoles, HolesThatTouchAreClosedEach) {
  // A chessboard: every second square is missing, and four rims meet in each vertex.
  const TriangleMesh mesh =
      plate(12, 0.004, [](unsigned i, unsigned j) { return i > 0 && j > 0 && i < 11 && j < 11 && (i + j) % 2 == 0; });
  const HoleClosingResult result = close(mesh, 0.08);
  judge(mesh, result, 0.08);
  EXPECT_EQ(result.count(LoopOutcome::closed), 50u);
  EXPECT_EQ(solidity_of({mesh.vertices, result.triangles}).boundary_loops, 1u);
}

TEST(CloseHoles, AnIslandThatTouchesTheRimStays) {
  const TriangleMesh mesh = plate(20, 0, [](unsigned i, unsigned j) {
    return i >= 5 && i <= 7 && j >= 5 && j <= 7 && !(i == 6 && j == 6) && !(i == 5 && j == 5);
  });
  const HoleClosingResult result = close(mesh, 0.11);
  judge(mesh, result, 0.11);
  EXPECT_EQ(outcomes(result), (Outcomes{LoopOutcome::turned, LoopOutcome::closed}));
  EXPECT_TRUE(solidity_of({mesh.vertices, result.triangles}).manifold());
}

TEST(CloseHoles, NothingIsFilledAcrossASpikeInTheHole) {
  TriangleMesh mesh = plate(10, 0, [](unsigned i, unsigned j) { return i == 4 && j == 4; });
  ASSERT_EQ(close(mesh, 0.06).count(LoopOutcome::closed), 1u);
  // A needle stands in the middle of the hole.
  const TriangleMesh needle{{{0.45, 0.44, -0.3}, {0.45, 0.46, -0.3}, {0.44, 0.45, 0.3}}, {{0, 1, 2}}};
  mesh = shapes::joined(mesh, needle);
  const HoleClosingResult result = close(mesh, 0.06);
  judge(mesh, result, 0.06);
  EXPECT_EQ(result.loops[1].outcome, LoopOutcome::crossing);
}

TEST(CloseHoles, AFillingGoesAroundWhatStandsInTheWay) {
  // The needle stands beside the middle, so that one diagonal of the square is free and the shorter one is not.
  TriangleMesh mesh = plate(10, 0, [](unsigned i, unsigned j) { return i == 4 && j == 4; });
  const auto corner = [](unsigned i, unsigned j) { return i * 11 + j; };
  mesh.vertices[corner(4, 4)].z = mesh.vertices[corner(5, 5)].z = 0.02;
  const HoleClosingResult alone = close(mesh, 0.06);
  ASSERT_EQ(alone.count(LoopOutcome::closed), 1u);
  // The two diagonals are 0.02 apart in the middle. A sheet that is as high as the one that was taken crosses it.
  const auto uses = [&](const HoleClosingResult& result, unsigned a, unsigned b) {
    const glm::uvec3& t = result.triangles.back();
    return (t.x == a || t.y == a || t.z == a) && (t.x == b || t.y == b || t.z == b);
  };
  const bool is_high = uses(alone, corner(4, 4), corner(5, 5));
  const double z = is_high ? 0.02 : 0;
  const TriangleMesh sheet{{{0.449, 0.449, z - 0.001}, {0.451, 0.449, z + 0.001}, {0.45, 0.451, z + 0.001}},
                           {{0, 1, 2}}};
  mesh = shapes::joined(mesh, sheet);
  const HoleClosingResult result = close(mesh, 0.06);
  judge(mesh, result, 0.06);
  ASSERT_EQ(result.loops[1].outcome, LoopOutcome::closed);
  EXPECT_NE(uses(result, corner(4, 4), corner(5, 5)), is_high);
}

TEST(CloseHoles, AFillingOfALongLoopGoesAroundWhatStandsInTheWay) {
  // The end of a tube bulges, and a small sheet stands where the filling was.
  TriangleMesh mesh = tube(240, 1, 4, 4);
  for (unsigned i = 0; i < 240; ++i) mesh.vertices[i].z += 0.2 * std::sin(2 * std::numbers::pi * i / 80);
  CloseHolesOptions options;
  options.largest_perimeter = 8;
  const HoleClosingResult alone = close(mesh, 1.3, options);
  ASSERT_EQ(alone.loops[0].corners, 240u);
  ASSERT_EQ(alone.loops[0].outcome, LoopOutcome::closed);
  // Through the middle of the largest of its triangles.
  std::pair<double, std::uint32_t> largest{0, 0};
  for (auto t = std::uint32_t(mesh.triangles.size()); t < alone.triangles.size(); ++t) {
    if (alone.loop[t - mesh.triangles.size()] != 0) continue;
    const glm::uvec3& c = alone.triangles[t];
    const dvec3 n = glm::cross(mesh.vertices[c.y] - mesh.vertices[c.x], mesh.vertices[c.z] - mesh.vertices[c.x]);
    largest = std::max(largest, std::pair(glm::length(n), t));
  }
  const glm::uvec3& c = alone.triangles[largest.second];
  const dvec3 middle = (mesh.vertices[c.x] + mesh.vertices[c.y] + mesh.vertices[c.z]) / 3.0;
  const TriangleMesh sheet{
      {middle + dvec3(0.01, 0, -0.01), middle + dvec3(-0.01, 0.01, 0.01), middle + dvec3(-0.01, -0.01, 0.01)},
      {{0, 1, 2}}};
  mesh = shapes::joined(mesh, sheet);
  const HoleClosingResult result = close(mesh, 1.3, options);
  judge(mesh, result, 1.3);
  EXPECT_EQ(result.loops[0].outcome, LoopOutcome::closed);
  EXPECT_EQ(std::count(result.triangles.begin(), result.triangles.end(), c), 0);
}

TEST(CloseHoles, ShellsWithinShellsAreClosedEach) {
  // Walls thinner than the tolerance, with holes at the same places.
  const auto hole = [](unsigned t) { return t == 100 || t == 101 || t == 300; };
  const TriangleMesh outer = without(shapes::sphere(14, 1), hole);
  const TriangleMesh mesh = shapes::joined(outer, without(shapes::turned(shapes::sphere(14, 0.97)), hole));
  const HoleClosingResult result = close(mesh, 0.1);
  judge(mesh, result, 0.1);
  EXPECT_EQ(result.count(LoopOutcome::closed), result.loops.size());
  EXPECT_EQ(result.loops.size(), 4u);
}

/// Two sheets, one above the other, with holes of six corners, of which three are the same vertices. In a plane the
/// Delaunay triangulation of each hole has the triangle of these three.
TriangleMesh touching_holes() {
  TriangleMesh mesh;
  std::vector<unsigned> rims[2];
  const auto add = [&](unsigned corner, double radius, double z) {
    const double a = std::numbers::pi / 3 * corner;
    mesh.vertices.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
    return unsigned(mesh.vertices.size()) - 1;
  };
  for (unsigned k = 0; k < 6; ++k) {
    rims[0].push_back(add(k, k % 2 ? 1.2 : 1, 0));
    rims[1].push_back(k % 2 ? add(k, 1.05, 0.1) : rims[0][k]);
  }
  for (unsigned sheet = 0; sheet < 2; ++sheet) {
    std::vector<unsigned> outer;
    for (unsigned k = 0; k < 6; ++k) outer.push_back(add(k, 2, sheet ? 0.15 : -0.05));
    for (unsigned k = 0; k < 6; ++k) {
      const unsigned n = (k + 1) % 6;
      mesh.triangles.emplace_back(rims[sheet][k], outer[k], outer[n]);
      mesh.triangles.emplace_back(rims[sheet][k], outer[n], rims[sheet][n]);
    }
  }
  return mesh;
}

TEST(CloseHoles, OfTwoHolesThatWouldGetTheSameTriangleTheSecondGetsOthers) {
  const TriangleMesh mesh = touching_holes();
  CloseHolesOptions options;
  options.largest_perimeter = 8;
  const HoleClosingResult result = close(mesh, 1.1, options);
  judge(mesh, result, 1.1);
  ASSERT_EQ(result.loops.size(), 4u);
  EXPECT_EQ(result.count(LoopOutcome::closed), 2u);
  EXPECT_EQ(result.count(LoopOutcome::perimeter), 2u);
  std::size_t on_shared = 0;
  for (std::size_t t = mesh.triangles.size(); t < result.triangles.size(); ++t) {
    const glm::uvec3& c = result.triangles[t];
    bool shared = true;
    for (int k = 0; k < 3; ++k) shared &= std::abs(glm::length(mesh.vertices[c[k]]) - 1) < 1e-9;
    on_shared += shared;
  }
  EXPECT_EQ(on_shared, 1u);
}

TEST(CloseHoles, RimsOfMixedOrientationStayOpen) {
  TriangleMesh mesh = without(shapes::torus(24), [](unsigned t) { return t == 700 || t == 300; });
  const glm::uvec3 missing = shapes::torus(24).triangles[700];
  for (glm::uvec3& t : mesh.triangles) {
    unsigned shared = 0;
    for (int k = 0; k < 9; ++k) shared += t[k / 3] == missing[k % 3];
    if (shared == 2) {
      std::swap(t.y, t.z);
      break;
    }
  }
  const HoleClosingResult result = close(mesh, 0.05);
  judge(mesh, result, 0.05);
  EXPECT_GE(result.count(LoopOutcome::not_a_loop), 1u);
  EXPECT_EQ(result.count(LoopOutcome::closed), 1u);
}

TEST(CloseHoles, DoubleSheetsAndCoincidentVerticesAreHandled) {
  // Seams between vertices at one place, and each sheet twice in opposite directions: nothing is open there.
  const TriangleMesh holed = without(shapes::torus(24), [](unsigned t) { return t == 700; });
  const HoleClosingResult seams = close(shapes::soup(holed), 0.05);
  EXPECT_EQ(outcomes(seams), Outcomes{LoopOutcome::closed});
  judge(shapes::soup(holed), seams, 0.05);
  TriangleMesh sheets = holed;
  for (const glm::uvec3& t : holed.triangles) sheets.triangles.emplace_back(t.x, t.z, t.y);
  EXPECT_TRUE(close(sheets, 0.05).loops.empty());
}

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
      polls_of([&] { found = outcomes(close_holes(mesh.vertices, mesh.triangles, kSpace, *volume)); });
  EXPECT_EQ(found, (Outcomes{LoopOutcome::too_long, LoopOutcome::too_long}));
  EXPECT_LT(polls, n / 100);
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

TEST(CloseHoles, AWideHoleNeedsFewProofs) {
  // 144 corners; the proof of a triangle across the hole takes thousands of parts, and only 142 triangles need one.
  const unsigned n = 60;
  const TriangleMesh whole = shapes::grid(n);
  const TriangleMesh mesh = without(whole, [&](unsigned t) {
    const unsigned row = t / 2 / n, column = t / 2 % n;
    return row >= 12 && row < 48 && column >= 12 && column < 48;
  });
  const auto volume = volume_of(whole, 0.002);
  CloseHolesOptions options;
  options.largest_perimeter = 3;  // between those of the hole, 2.4, and of the border, 4
  const std::size_t polls = polls_of([&] {
    const HoleClosingResult result = close_holes(mesh.vertices, mesh.triangles, kSpace, *volume, options);
    EXPECT_EQ(outcomes(result), (Outcomes{LoopOutcome::perimeter, LoopOutcome::closed}));
  });
  EXPECT_LT(polls, 18000u);
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

TEST(CloseHoles, RefusesBadInput) {
  TriangleMesh mesh = shapes::torus(8);
  const auto volume = volume_of(mesh, 0.05);
  const auto refuses = [&](const TriangleMesh& bad, const CloseHolesOptions& options = {}) {
    EXPECT_THROW(close_holes(bad.vertices, bad.triangles, kSpace, *volume, options), InvalidInput);
  };
  refuses({});
  refuses({mesh.vertices, {}});
  TriangleMesh bad = mesh;
  bad.vertices[3].y = std::numeric_limits<double>::quiet_NaN();
  refuses(bad);
  bad = mesh;
  bad.triangles[3].y = 1000;
  refuses(bad);
  for (const double angle : {0.0, -1.0, 181.0, std::numeric_limits<double>::quiet_NaN()}) {
    refuses(mesh, {.max_normal_angle = angle});
  }
  for (const double perimeter : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    refuses(mesh, {.largest_perimeter = perimeter});
  }
}

TEST(CloseHoles, RandomHolesKeepTheirPromises) {
  shapes::Random random(21);
  std::size_t closed = 0, refused = 0;
  for (int round = 0; round < many(24); ++round) {
    const unsigned n = 8 + random.below(20);
    TriangleMesh mesh = random.below(2) ? shapes::torus(n, 0.05 * random.share()) : shapes::sphere(n / 2);
    for (dvec3& p : mesh.vertices) p += 0.02 * random.share() * random.point();
    const double share = 0.6 * random.share();
    mesh = without(mesh, [&](unsigned) { return random.share() < share; });
    if (mesh.triangles.empty()) continue;
    switch (random.below(5)) {
      case 0:  // some are turned over
        for (glm::uvec3& t : mesh.triangles) {
          if (random.share() < 0.05) std::swap(t.y, t.z);
        }
        break;
      case 1:  // some are there twice, some with two corners at one place
        for (int k = 0; k < 10; ++k) {
          const glm::uvec3 t = mesh.triangles[random.below(unsigned(mesh.triangles.size()))];
          mesh.triangles.push_back(random.below(2) ? glm::uvec3(t.y, t.z, t.x) : glm::uvec3(t.x, t.y, t.x));
        }
        break;
      case 2:
        mesh = shapes::soup(mesh);
        break;
      case 3:  // some vertices are at the places of others
        for (int k = 0; k < 5; ++k) {
          mesh.vertices[random.below(unsigned(mesh.vertices.size()))] =
              mesh.vertices[random.below(unsigned(mesh.vertices.size()))];
        }
        break;
      default:
        break;
    }
    const double tolerance = 0.02 + 0.3 * random.share();
    const HoleClosingResult result = close(mesh, tolerance);
    SCOPED_TRACE(round);
    judge(mesh, result, tolerance);
    closed += result.count(LoopOutcome::closed);
    refused += result.loops.size() - result.count(LoopOutcome::closed);
  }
  EXPECT_GT(closed, kSanitized ? 20u : 300u);
  EXPECT_GT(refused, 30u);
}

}  // namespace
