// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/close_holes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/errors.h"
#include "holes.h"
#include "many.h"
#include "shapes.h"
#include "topology/solidity.h"
#include "without.h"

namespace {

using namespace tolvol;
using namespace tolvol::holes;

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
