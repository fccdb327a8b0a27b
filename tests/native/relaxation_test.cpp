// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/relaxation.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>

#include "base/parallel.h"
#include "patches.h"
#include "polls.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using patches::kMiddle;
using patches::Plate;

TEST(Relaxation, BringsAllVerticesOfAPatchBackToThePlane) {
  Plate f(1.5);
  Relaxation relaxation;
  const PatchDeviations::State before = f.deviations.state();
  EXPECT_GE(before.largest, 1.5);
  EXPECT_FALSE(f.deviations.enough());
  EXPECT_TRUE(relaxation.lower_sum(f.deviations, 8, false));
  EXPECT_TRUE(f.deviations.enough());
  EXPECT_LT(f.deviations.state().energy, 0.01 * before.energy);
  EXPECT_LE(f.height(), PatchDeviations::kEnough);
}

TEST(Relaxation, GivesUpWhatIsBeyondHope) {
  Plate f(20);
  Relaxation relaxation;
  EXPECT_FALSE(relaxation.lower_sum(f.deviations, 14, true));
  EXPECT_NEAR(f.height(), 20, 1e-6) << "before the first step";
}

TEST(Relaxation, HoldsPointsThatAreAdded) {
  Plate f(0);
  Relaxation relaxation;
  EXPECT_TRUE(f.deviations.enough());
  std::uint32_t face = 0;
  const dvec3 point = f.plate.mesh->position(kMiddle) + dvec3(0, 0, 1.4 * f.unit);
  EXPECT_NEAR(f.deviations.deviation(point, face), 1.4, 1e-6);
  f.deviations.add_reference_point(point, 1, face);
  f.deviations.renew();
  EXPECT_NEAR(f.deviations.state().largest, 1.4, 1e-6);
  relaxation.lower_largest(f.deviations, 12);
  EXPECT_TRUE(f.deviations.enough());
  EXPECT_LE(f.deviations.deviation(point, face), PatchDeviations::kEnough + 1e-9);
  EXPECT_GT(f.height(), 0.35) << "the surface has come towards the point";
}

TEST(Relaxation, GivesUpOnPointsThatContradictEachOther) {
  Plate f(0);
  Relaxation relaxation;
  std::uint32_t face = 0;
  const dvec3 middle = f.plate.mesh->position(kMiddle);
  f.deviations.deviation(middle, face);
  for (const double side : {1.4, -1.4}) {
    f.deviations.add_reference_point(middle + dvec3(0, 0, side * f.unit), 1, face);
  }
  f.deviations.renew();
  EXPECT_EQ(polls_of([&] { relaxation.try_lower_largest(f.deviations, 10); }), 1u) << "before the first step";
  EXPECT_GT(polls_of([&] { relaxation.lower_largest(f.deviations, 10); }), 5u);
  EXPECT_FALSE(f.deviations.enough());
}

TEST(Relaxation, HoldsPointsInHalfSpaces) {
  Plate f(0);
  Relaxation relaxation;
  const std::uint32_t face = f.patch.vertices()[f.patch.find_vertex(kMiddle)].faces.front();
  const dvec3 weights(0.5, 0.25, 0.25);
  for (const double side : {1.0, -1.0}) {
    // A flip may give the face other corners.
    const auto height = [&, corners = std::to_array(f.patch.faces()[face].corners)] {
      double z = 0;
      for (int k = 0; k < 3; ++k) z += weights[k] * f.patch.vertices()[corners[k]].position.z;
      return z / f.unit;
    };
    const Separation separation{weights, dvec3(0, 0, side), 0.3 * f.unit};
    f.deviations.add_separation(face, separation, 0.05);
    EXPECT_TRUE(f.deviations.has_separations());
    f.deviations.renew();
    EXPECT_NEAR(f.deviations.state().largest, 1 + 0.3 - side * height(), 1e-6);
    relaxation.lower_largest(f.deviations, 16);
    EXPECT_TRUE(f.deviations.enough());
    EXPECT_GT(side * height(), 0.3);
    EXPECT_LT(f.height(), 1) << "and no farther than the tolerance";
    f.deviations.drop_separations();
    EXPECT_FALSE(f.deviations.has_separations());
    f.deviations.renew();
    EXPECT_TRUE(f.deviations.enough());
  }
}

TEST(Relaxation, HoldsPointsOfFaces) {
  Plate f(0.9);
  Relaxation relaxation;
  const std::uint32_t middle = f.patch.find_vertex(kMiddle);
  const std::uint32_t face = f.patch.vertices()[middle].faces.front();
  EXPECT_NEAR(f.deviations.deviation_of(face, dvec3(1.0 / 3)), 0.9, 0.02);
  f.patch.vertices()[middle].position.z += 0.5 * f.unit;
  f.deviations.add_face_point(face, dvec3(1.0 / 3), 1);
  f.deviations.renew();
  EXPECT_FALSE(f.deviations.enough());
  relaxation.lower_largest(f.deviations, 12);
  EXPECT_TRUE(f.deviations.enough());
}

TEST(Relaxation, HoldsOpenPointsNearWhatTheFaceMayStandFor) {
  // Half a tolerance above the plate there is another one that faces down.
  TriangleMesh both = Plate::flat();
  const auto count = static_cast<std::uint32_t>(both.vertices.size());
  for (std::uint32_t v = 0; v < count; ++v) both.vertices.push_back(both.vertices[v] + dvec3(0, 0, 0.01));
  for (std::size_t t = 0, n = both.triangles.size(); t < n; ++t) {
    const glm::uvec3 corners = both.triangles[t];
    both.triangles.emplace_back(corners.x + count, corners.z + count, corners.y + count);
  }
  CertifiedMesh c(both, both.vertices, 0.02);
  const double unit = c.certificate->limit();
  Team alone(1);
  const FacingRule rule(c.volume->reference(), 1e-15, 1e-15, 0.5 * std::numbers::pi, alone);
  std::vector<dvec3> positions;
  for (std::uint32_t v = 0; v < both.vertices.size(); ++v) positions.push_back(c.mesh->position(v));
  const CertifiedBounds bounds({*c.certificate, &*c.coverage, nullptr, nullptr, &rule}, {both.triangles, positions},
                               alone);
  Change change(*c.mesh);
  Patch patch;
  patches::gather(*c.mesh, change, patch);
  PatchDeviations deviations(bounds);
  deviations.start(patch);
  const std::uint32_t face = patch.vertices()[patch.find_vertex(kMiddle)].faces.front();
  const double before = patch.position(face, 0).z;
  for (Patch::Vertex& v : patch.vertices()) {
    if (v.free) v.position.z += 1.2 * unit;
  }
  const dvec3 centre(1.0 / 3);
  EXPECT_LT(deviations.deviation_of(face, centre), 0.8) << "It is near the upper plate, and turned from it.";
  EXPECT_NEAR(deviations.admitted_deviation_of(face, centre), 1.2, 0.01);
  deviations.renew();
  EXPECT_TRUE(deviations.enough());
  deviations.add_open_point(face, centre, 1);
  deviations.renew();
  EXPECT_NEAR(deviations.state().largest, 1.2, 0.01);
  Relaxation().lower_largest(deviations, 16);
  EXPECT_TRUE(deviations.enough());
  EXPECT_LT((patch.position(face, 0).z + patch.position(face, 1).z + patch.position(face, 2).z) / 3 - before, unit);
}

TEST(Relaxation, FlipsEdgesOnlyIfItIsTold) {
  for (const bool flip : {false, true}) {
    patches::Ridge f(true);
    const double before = f.deviations.state().energy;
    Relaxation().lower_sum(f.deviations, 14, flip);
    EXPECT_EQ(f.patch.flips().empty(), !flip);
    EXPECT_EQ(f.deviations.state().energy < before, flip);
  }
}

}  // namespace
