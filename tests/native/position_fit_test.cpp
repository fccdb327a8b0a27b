// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/position_fit.h"

#include <gtest/gtest.h>

#include <optional>

#include "check/certificate.h"
#include "shapes.h"
#include "topology/manifold_cut.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// A plate, flat at height 0 in its own frame, whose mesh is the reference itself.
struct Plate {
  explicit Plate(double height, unsigned n = 8) {
    reference = shapes::grid(n);
    for (dvec3& p : reference.vertices) p.z = 0;
    lifted = (n / 2) * (n + 1) + n / 2;
    volume.emplace(reference.vertices, reference.triangles, StoredSpace(glm::dmat4(1), Storage::float64), 0.2,
                   ToleranceVolume::Options{.precision = 8});
    space = StoredSpace(glm::dmat4(1), Storage::float64).in(volume->frame());
    certificate.emplace(volume->witnesses(), volume->grid(), volume->hierarchy(), volume->frame_tolerance(),
                        volume->frame_tolerance());
    coverage.emplace(volume->reference(), volume->frame_tolerance(), reference.triangles.size());
    for (std::uint32_t i = 0; i < reference.triangles.size(); ++i) coverage->set_witness(i, i);
    BoundedMeshInput input;
    std::vector<dvec3> positions;
    Team alone(1);
    input.triangles = reference.triangles;
    input.mates = cut_to_manifold(reference.vertices, reference.triangles, alone).mates;
    for (std::uint32_t v = 0; v < reference.vertices.size(); ++v) {
      dvec3 p = reference.vertices[v];
      if (v == lifted) p.z = height;
      input.positions.push_back({p, space->frame(p)});
      positions.push_back(space->frame(p));
      input.slots.push_back(v);
    }
    input.pinned.assign(reference.vertices.size(), false);
    input.store = [this](const dvec3& p) { return VertexPosition{space->store(p), p}; };
    bounds.emplace(CertifiedBounds::Directions{*certificate, &*coverage}, positions, reference.triangles.size(), false);
    mesh.emplace(std::move(input), &*bounds, alone);
  }

  TriangleMesh reference;
  std::uint32_t lifted;
  std::optional<StoredSpace> space;
  std::optional<ToleranceVolume> volume;
  std::optional<TriangleCertificate> certificate;
  std::optional<Coverage> coverage;
  std::optional<CertifiedBounds> bounds;
  std::optional<BoundedMesh> mesh;
};

TEST(PositionFit, BringsALiftedVertexBackToThePlane) {
  const Plate plate(0.1);
  Change change(*plate.mesh);
  PositionFit fit(*plate.mesh);
  const dvec3 start = plate.mesh->position(plate.lifted);
  ASSERT_TRUE(change.prepare_relocate(plate.lifted, plate.mesh->vertex_position(plate.lifted)));
  fit.gather(change);
  const PositionFit::Fit first = fit.fit(change, start);
  const double height = 0.1 * plate.volume->frame().scale();
  EXPECT_GT(first.energy, 0);
  EXPECT_DOUBLE_EQ(first.energy, fit.energy_now(change));
  EXPECT_LT(std::abs(first.position.z - start.z + height), 0.05 * height) << "a plane is met in one step";
  EXPECT_LT(glm::length(glm::dvec2(first.position - start)), 0.05 * height) << "and nothing pulls it sideways";

  const double inside = 2 * first.deviation, beyond = 0.5 * first.deviation;
  EXPECT_EQ(fit.fit(change, start, inside).position, first.position);
  EXPECT_GT(fit.fit(change, start, beyond).deviation, beyond);
  EXPECT_EQ(fit.fit(change, start, beyond).position, start) << "is given up";

  ASSERT_TRUE(change.prepare_relocate(plate.lifted, {first.position, first.position}));
  EXPECT_LT(fit.fit(change, first.position).energy, 1e-3 * first.energy);
  EXPECT_DOUBLE_EQ(fit.energy_now(change), first.energy) << "of the faces as they are";
}

TEST(PositionFit, StaysWhereNothingDeviates) {
  const Plate plate(0);
  Change change(*plate.mesh);
  PositionFit fit(*plate.mesh);
  const dvec3 start = plate.mesh->position(plate.lifted);
  ASSERT_TRUE(change.prepare_relocate(plate.lifted, plate.mesh->vertex_position(plate.lifted)));
  fit.gather(change);
  const PositionFit::Fit at_rest = fit.fit(change, start);
  EXPECT_LT(at_rest.energy, 1e-9);
  EXPECT_LT(glm::length(at_rest.position - start), 0.02);
}

}  // namespace
