// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/relaxation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "certified_mesh.h"
#include "decimation/surface_samples.h"
#include "polls.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr unsigned kSide = 10;
constexpr std::uint32_t kMiddle = (kSide / 2) * (kSide + 1) + kSide / 2;

/// A flat plate, which is its own reference, and a patch around a collapse in its middle.
struct Fixture {
  explicit Fixture(double lift) : plate(flat(), flat().vertices, 0.02), change(*plate.mesh) {
    SurfaceSamples samples(*plate.mesh, plate.team);
    const auto h =
        plate.mesh->connectivity().find_halfedge(BoundedMesh::handle(kMiddle - 1), BoundedMesh::handle(kMiddle));
    if (!change.prepare_collapse(h, plate.mesh->vertex_position(kMiddle))) throw std::logic_error("no collapse");
    patch.gather(change, 2, true);
    unit = plate.certificate->limit();
    for (Patch::Vertex& v : patch.vertices()) {
      if (v.free) v.position.z += lift * unit;
    }
    relaxation.emplace(*plate.bounds);
    relaxation->start(patch);
    for (std::uint32_t f = 0; f < patch.faces().size(); ++f) relaxation->add(samples.of(patch.faces()[f].id), f);
    for (const Coverage::Removed& r : change.removed()) relaxation->add(samples.of(r.id), r.successor);
    relaxation->renew();
  }
  static TriangleMesh flat() {
    TriangleMesh mesh = shapes::grid(kSide);
    for (dvec3& p : mesh.vertices) p.z = 0;
    return mesh;
  }
  double height() const {
    double highest = 0;
    for (const Patch::Vertex& v : patch.vertices()) highest = std::max(highest, std::abs(v.position.z) / unit);
    return highest;
  }

  CertifiedMesh plate;
  Change change;
  Patch patch;
  double unit = 0;
  std::optional<Relaxation> relaxation;
};

TEST(Relaxation, BringsAllVerticesOfAPatchBackToThePlane) {
  Fixture f(1.5);
  const Relaxation::State before = f.relaxation->state();
  EXPECT_GE(before.largest, 1.5);
  EXPECT_FALSE(f.relaxation->enough());
  EXPECT_TRUE(f.relaxation->lower_sum(8, false));
  EXPECT_TRUE(f.relaxation->enough());
  EXPECT_LT(f.relaxation->state().energy, 0.01 * before.energy);
  EXPECT_LE(f.height(), Relaxation::kEnough);
}

TEST(Relaxation, GivesUpWhatIsBeyondHope) {
  Fixture f(20);
  EXPECT_FALSE(f.relaxation->lower_sum(14, true));
  EXPECT_NEAR(f.height(), 20, 1e-6) << "before the first step";
}

TEST(Relaxation, HoldsPointsThatAreAdded) {
  Fixture f(0);
  EXPECT_TRUE(f.relaxation->enough());
  std::uint32_t face = 0;
  const dvec3 point = f.plate.mesh->position(kMiddle) + dvec3(0, 0, 1.4 * f.unit);
  EXPECT_NEAR(f.relaxation->deviation(point, face), 1.4, 1e-6);
  const SurfaceSample sample{point, 1, 0};
  f.relaxation->add({&sample, 1}, face);
  f.relaxation->renew();
  EXPECT_NEAR(f.relaxation->state().largest, 1.4, 1e-6);
  f.relaxation->lower_largest(12);
  EXPECT_TRUE(f.relaxation->enough());
  EXPECT_LE(f.relaxation->deviation(point, face), Relaxation::kEnough + 1e-9);
  EXPECT_GT(f.height(), 0.35) << "the surface has come towards the point";
}

TEST(Relaxation, GivesUpOnPointsThatContradictEachOther) {
  Fixture f(0);
  std::uint32_t face = 0;
  const dvec3 middle = f.plate.mesh->position(kMiddle);
  f.relaxation->deviation(middle, face);
  for (const double side : {1.4, -1.4}) {
    const SurfaceSample sample{middle + dvec3(0, 0, side * f.unit), 1, 0};
    f.relaxation->add({&sample, 1}, face);
  }
  f.relaxation->renew();
  EXPECT_EQ(polls_of([&] { f.relaxation->try_lower_largest(10); }), 1u) << "before the first step";
  EXPECT_GT(polls_of([&] { f.relaxation->lower_largest(10); }), 5u);
  EXPECT_FALSE(f.relaxation->enough());
}

TEST(Relaxation, IsStuckWhereAPointLiesBetweenVerticesThatDoNotMove) {
  Fixture f(0);
  const auto is_fixed = [&](std::uint32_t v) { return !f.patch.vertices()[v].free; };
  const auto faces = f.patch.faces();
  const auto rim = std::ranges::find_if(faces, [&](const Patch::Face& x) {
    return is_fixed(x.corners[0]) && is_fixed(x.corners[1]) != is_fixed(x.corners[2]);
  });
  ASSERT_NE(rim, faces.end());
  const auto face = static_cast<std::uint32_t>(rim - faces.begin());
  const bool second = is_fixed(rim->corners[1]);
  const dvec3 fixed = second ? dvec3(0.5, 0.5, 0) : dvec3(0.5, 0, 0.5);
  const auto stuck = [&](const dvec3& weights, double offset) {
    f.relaxation->drop_separations();
    f.relaxation->add_separation(face, {weights, dvec3(0, 0, 1), offset * f.unit}, 0.05);
    f.relaxation->renew();
    return f.relaxation->is_stuck();
  };
  EXPECT_TRUE(stuck(fixed, 0.3));
  EXPECT_FALSE(stuck(fixed, -0.3)) << "it need not move";
  EXPECT_FALSE(stuck(dvec3(1.0 / 3), 0.3)) << "the third corner moves";
}

TEST(Relaxation, HoldsPointsInHalfSpaces) {
  Fixture f(0);
  const std::uint32_t face = f.patch.vertices()[f.patch.find_vertex(kMiddle)].faces.front();
  const dvec3 weights(0.5, 0.25, 0.25);
  const auto height = [&] {
    double z = 0;
    for (int k = 0; k < 3; ++k) z += weights[k] * f.patch.position(face, k).z;
    return z / f.unit;
  };
  for (const double side : {1.0, -1.0}) {
    const Separation separation{weights, dvec3(0, 0, side), 0.3 * f.unit};
    f.relaxation->add_separation(face, separation, 0.05);
    EXPECT_TRUE(f.relaxation->has_separations());
    f.relaxation->renew();
    EXPECT_NEAR(f.relaxation->state().largest, 1 + 0.3 - side * height(), 1e-6);
    f.relaxation->lower_largest(16);
    EXPECT_TRUE(f.relaxation->enough());
    EXPECT_GT(side * height(), 0.3);
    EXPECT_LT(f.height(), 1) << "and no farther than the tolerance";
    f.relaxation->drop_separations();
    EXPECT_FALSE(f.relaxation->has_separations());
    f.relaxation->renew();
    EXPECT_TRUE(f.relaxation->enough());
  }
}

TEST(Relaxation, HoldsPointsOfFaces) {
  Fixture f(0.9);
  const std::uint32_t middle = f.patch.find_vertex(kMiddle);
  const std::uint32_t face = f.patch.vertices()[middle].faces.front();
  EXPECT_NEAR(f.relaxation->deviation_of(face, dvec3(1.0 / 3)), 0.9, 0.02);
  f.patch.vertices()[middle].position.z += 0.5 * f.unit;
  f.relaxation->add_face_point(face, dvec3(1.0 / 3), 1);
  f.relaxation->renew();
  EXPECT_FALSE(f.relaxation->enough());
  f.relaxation->lower_largest(12);
  EXPECT_TRUE(f.relaxation->enough());
}

TEST(Relaxation, HoldsOpenPointsNearWhatTheFaceMayStandFor) {
  // Half a tolerance above the plate there is another one that faces down.
  TriangleMesh both = Fixture::flat();
  const auto count = static_cast<std::uint32_t>(both.vertices.size());
  for (std::uint32_t v = 0; v < count; ++v) both.vertices.push_back(both.vertices[v] + dvec3(0, 0, 0.01));
  for (std::size_t t = 0, n = both.triangles.size(); t < n; ++t) {
    const glm::uvec3 corners = both.triangles[t];
    both.triangles.emplace_back(corners.x + count, corners.z + count, corners.y + count);
  }
  CertifiedMesh c(both, both.vertices, 0.02);
  const double unit = c.certificate->limit();
  const FacingRule rule(c.volume->reference(), 1e-15, 1e-15, 0.5 * std::numbers::pi);
  std::vector<dvec3> positions;
  for (std::uint32_t v = 0; v < both.vertices.size(); ++v) positions.push_back(c.mesh->position(v));
  const CertifiedBounds bounds({*c.certificate, &*c.coverage, nullptr, nullptr, &rule}, {both.triangles, positions});
  Change change(*c.mesh);
  const auto h = c.mesh->connectivity().find_halfedge(BoundedMesh::handle(kMiddle - 1), BoundedMesh::handle(kMiddle));
  ASSERT_TRUE(change.prepare_collapse(h, c.mesh->vertex_position(kMiddle)));
  Patch patch;
  patch.gather(change, 2, true);
  Relaxation relaxation(bounds);
  relaxation.start(patch);
  const std::uint32_t face = patch.vertices()[patch.find_vertex(kMiddle)].faces.front();
  const double before = patch.position(face, 0).z;
  for (Patch::Vertex& v : patch.vertices()) {
    if (v.free) v.position.z += 1.2 * unit;
  }
  const dvec3 centre(1.0 / 3);
  EXPECT_LT(relaxation.deviation_of(face, centre), 0.8) << "It is near the upper plate, and turned from it.";
  EXPECT_NEAR(relaxation.admitted_deviation_of(face, centre), 1.2, 0.01);
  relaxation.renew();
  EXPECT_TRUE(relaxation.enough());
  relaxation.add_open_point(face, centre, 1);
  relaxation.renew();
  EXPECT_NEAR(relaxation.state().largest, 1.2, 0.01);
  relaxation.lower_largest(16);
  EXPECT_TRUE(relaxation.enough());
  EXPECT_LT((patch.position(face, 0).z + patch.position(face, 1).z + patch.position(face, 2).z) / 3 - before, unit);
}

TEST(Relaxation, WhatWasBeyondBeforeMayStay) {
  Fixture f(0);
  std::uint32_t face = 0;
  const dvec3 point = f.plate.mesh->position(kMiddle) + dvec3(0, 0, 0.999 * f.unit);
  f.relaxation->deviation(point, face);
  const SurfaceSample as_before{point, 1, 0.9995};
  f.relaxation->add({&as_before, 1}, face);
  f.relaxation->renew();
  EXPECT_TRUE(f.relaxation->enough());
  const SurfaceSample worse{point, 1, 0.9};
  f.relaxation->add({&worse, 1}, face);
  f.relaxation->renew();
  EXPECT_FALSE(f.relaxation->enough());
}

TEST(Relaxation, FlipsEdgesAlongARidge) {
  // The reference has a ridge along the diagonals of a grid whose edges all run across it.
  TriangleMesh ridge = shapes::grid(kSide);
  for (dvec3& p : ridge.vertices)
    p.z = -0.7 * std::abs(p.x + p.y - ridge.vertices[kMiddle].x - ridge.vertices[kMiddle].y);
  TriangleMesh across = ridge;
  for (std::size_t i = 0; i + 1 < across.triangles.size(); i += 2) {
    // Both triangles of a square share the diagonal; the other diagonal replaces it.
    const glm::uvec3 a = across.triangles[i], b = across.triangles[i + 1];
    std::uint32_t apex_a = 0, apex_b = 0;
    for (int k = 0; k < 3; ++k) {
      if (a[k] != b.x && a[k] != b.y && a[k] != b.z) apex_a = a[k];
      if (b[k] != a.x && b[k] != a.y && b[k] != a.z) apex_b = b[k];
    }
    int k = 0;
    while (a[k] != apex_a) ++k;
    across.triangles[i] = {apex_a, a[(k + 1) % 3], apex_b};
    across.triangles[i + 1] = {apex_a, apex_b, a[(k + 2) % 3]};
  }
  for (const TriangleMesh& mesh : {ridge, across}) {
    CertifiedMesh c(mesh, mesh.vertices, 0.05);
    const auto h = c.mesh->connectivity().find_halfedge(BoundedMesh::handle(kMiddle - 1), BoundedMesh::handle(kMiddle));
    Change change(*c.mesh);
    ASSERT_TRUE(change.prepare_collapse(h, c.mesh->vertex_position(kMiddle)));
    Patch patch;
    patch.gather(change, 2, true);
    for (Patch::Vertex& v : patch.vertices()) v.free = false;  // Flips alone have to do it.
    Relaxation relaxation(*c.bounds);
    relaxation.start(patch);
    // The points of the ridge itself, of which one diagonal of each square has all and the other one none.
    std::vector<SurfaceSample> samples;
    for (double t = -0.1; t <= 0.1; t += 0.01) {
      const dvec3 middle = ridge.vertices[kMiddle];
      samples.push_back({c.space->frame(dvec3(middle.x + t, middle.y - t, 0)), 1, 0});
    }
    relaxation.add(samples, 0);
    relaxation.renew();
    const double before = relaxation.state().energy;
    relaxation.lower_sum(14, true);
    EXPECT_LE(relaxation.state().energy, before);
    if (before > 1) {
      EXPECT_GT(patch.flips().size(), 0u);
    }
    for (std::uint32_t f = 0; f < patch.faces().size(); ++f) {
      const dvec3 n =
          glm::cross(patch.position(f, 1) - patch.position(f, 0), patch.position(f, 2) - patch.position(f, 0));
      EXPECT_GT(n.z, 0) << "nothing folds over";
    }
  }
}

}  // namespace
