// SPDX-License-Identifier: GPL-3.0-or-later
// What stands in the way of a filling: other faces, and other fillings.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "holes.h"
#include "repair/close_holes.h"
#include "shapes.h"
#include "without.h"

namespace {

using namespace tolvol;
using namespace tolvol::holes;

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

}  // namespace
