// SPDX-License-Identifier: GPL-3.0-or-later
// Flat faces, where a collapse costs nothing: few triangles remain of however many.
#include <gtest/gtest.h>

#include "decimation/decimation.h"
#include "decimation_cases.h"
#include "many.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::expect_within;
using cases::run;
using glm::dvec3;

TEST(Decimation, FlatPlatesEndAtAnyTolerance) {
  // Every collapse costs nothing here, and the tolerance is far below the triangles' size.
  for (const double percent : {1.0, 0.05, 0.01}) {
    const Case c{shapes::stored(shapes::grid(20)), glm::dmat4(1), Storage::float32, percent};
    const DecimationResult r = run(c);
    expect_within(c, r);
    EXPECT_EQ(r.triangles.size(), 2u) << percent;
  }
}

TEST(Decimation, LargePlatesBecomeTwoTriangles) {
  // A face of the result lies near tens of thousands of triangles of the reference: more than a proof looks at.
  for (const unsigned n : {across(128), across(150)}) {
    if (kSanitized && n == across(150)) break;
    const Case c{shapes::stored(shapes::grid(n)), glm::dmat4(1), Storage::float32, 0.03};
    const DecimationResult r = run(c);
    expect_within(c, r);
    EXPECT_EQ(r.triangles.size(), 2u) << n;
  }
}

// Where a collapse along a side has to wait, a corner must not leave its place for it.
TEST(Decimation, LargeBoxesBecomeTwelveTriangles) {
  TriangleMesh mesh = shapes::box(kSanitized ? 16 : 64);
  for (glm::dvec3& v : mesh.vertices) v *= glm::dvec3(0.52, 0.95, 0.15);
  for (const auto placement : {DecimationOptions::Placement::optimal, DecimationOptions::Placement::subset}) {
    const Case c{shapes::stored(mesh), glm::dmat4(1), Storage::float32, 0.1};
    DecimationOptions options;
    options.placement = placement;
    const DecimationResult r = run(c, options);
    expect_within(c, r);
    EXPECT_EQ(r.triangles.size(), 12u);
  }
}

TEST(Decimation, RoundingToFloatDoesNotKeepAPlateInPieces) {
  // Turned, a plate of float32 is flat up to a two-thousandth of this tolerance.
  Case c{shapes::grid(across(128)), glm::dmat4(1), Storage::float32, 0.1};
  const dvec3 u = glm::normalize(dvec3(1, 2, 3)), v = glm::normalize(glm::cross(u, dvec3(1, 0, -2)));
  for (dvec3& p : c.mesh.vertices) p = dvec3(0.3, -0.2, 0.7) + p.x * u + p.y * v + p.z * glm::cross(u, v);
  c.mesh = shapes::stored(c.mesh);
  const DecimationResult r = run(c);
  expect_within(c, r);
  EXPECT_LE(r.triangles.size(), 4u);
}

}  // namespace
