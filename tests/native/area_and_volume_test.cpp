// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/area_and_volume.h"

#include <gtest/gtest.h>

#include "shapes.h"
#include "topology/solidity.h"

namespace {

using namespace tolvol;
using glm::dvec3;

AreaAndVolume measured(const TriangleMesh& mesh, const glm::dmat3& linear = glm::dmat3(1)) {
  Team team(1);
  const Solidity found = solidity(mesh.vertices, mesh.triangles, team);
  return area_and_volume(mesh.vertices, mesh.triangles, found.shell_of, linear);
}

/// A cube with sides of 2 around the origin, in 12 triangles.
TriangleMesh cube(double scale = 1, const dvec3& at = dvec3(0)) {
  TriangleMesh mesh = shapes::box(1);
  dvec3 largest(0);
  for (const dvec3& v : mesh.vertices) largest = glm::max(largest, v);
  for (dvec3& v : mesh.vertices) v = scale * (2.0 * v / largest - 1.0) + at;
  return mesh;
}

void expect_near(const AreaAndVolume& found, double area, double volume) {
  EXPECT_NEAR(found.area / area, 1, 1e-12);
  EXPECT_NEAR(found.volume / volume, 1, 1e-12);
}

TEST(AreaAndVolume, ShellsFarApartCostNoDigits) {
  const TriangleMesh two = shapes::joined(cube(), cube(1, {1e8, -1e8, 1e8}));
  expect_near(measured(two), 48, 16);
  expect_near(measured(shapes::joined(cube(), cube(0x1p-20, {1e3, 0, 0}))), 24 + 24 * 0x1p-40, 8 + 8 * 0x1p-60);
}

TEST(AreaAndVolume, UnusedVerticesCountForNothing) {
  TriangleMesh mesh = cube();
  mesh.vertices.emplace_back(1e300, 1e300, -1e300);
  expect_near(measured(mesh), 24, 8);
}

TEST(AreaAndVolume, NothingOverflowsOrVanishesBeforeTheResultDoes) {
  expect_near(measured(cube(1e100)), 24e200, 8e300);
  expect_near(measured(cube(1e-100)), 24e-200, 8e-300);
  expect_near(measured(cube(1e-200), glm::dmat3(1e300)), 24e200, 8e300);
  const AreaAndVolume huge = measured(cube(1.7e308)), tiny = measured(cube(1e-310));
  EXPECT_EQ(huge.area, std::numeric_limits<double>::infinity());
  EXPECT_EQ(huge.volume, std::numeric_limits<double>::infinity());
  EXPECT_EQ(tiny.area, 0);
  EXPECT_EQ(tiny.volume, 0);
  glm::dmat3 uneven(1);
  uneven[0][0] = 1e-50, uneven[1][1] = 1, uneven[2][2] = 1e100;
  expect_near(measured(cube(), uneven), 8 * (1e-50 + 1e50 + 1e100), 8e50);
}

TEST(AreaAndVolume, TheSignIsThatOfTheFacesNotOfTheMirror) {
  glm::dmat3 mirror(2);
  mirror[0][0] = -2;
  expect_near(measured(cube(), mirror), 96, 64);
  TriangleMesh inside_out = cube();
  for (glm::uvec3& t : inside_out.triangles) std::swap(t.y, t.z);
  expect_near(measured(inside_out), 24, -8);
  expect_near(measured(inside_out, mirror), 96, -64);
}

TEST(AreaAndVolume, AnEmptyMeshHasNone) {
  EXPECT_EQ(measured({}).area, 0);
  EXPECT_EQ(measured({}).volume, 0);
}

}  // namespace
