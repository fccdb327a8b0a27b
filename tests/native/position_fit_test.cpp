// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/position_fit.h"

#include <gtest/gtest.h>

#include "certified_mesh.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr unsigned kSide = 8;
constexpr std::uint32_t kLifted = (kSide / 2) * (kSide + 1) + kSide / 2;

/// A flat plate, and the mesh with one vertex lifted. All faces may use the same share of the tolerance.
CertifiedMesh plate_lifted_by(double height, double share = 1) {
  TriangleMesh reference = shapes::grid(kSide);
  for (dvec3& p : reference.vertices) p.z = 0;
  std::vector<dvec3> vertices = reference.vertices;
  vertices[kLifted].z = height;
  return {reference, vertices, 0.2, {}, std::vector<double>(vertices.size(), share)};
}

/// A fit of the lifted vertex, with a change prepared that leaves it where it is.
struct LiftedFit {
  explicit LiftedFit(double height, double share = 1) : plate(plate_lifted_by(height, share)) {
    EXPECT_TRUE(change.prepare_relocate(kLifted, plate.mesh->vertex_position(kLifted)));
  }
  const CertifiedMesh plate;
  Change change{*plate.mesh};
  PositionFit fit{*plate.mesh};
  const dvec3 start = plate.mesh->position(kLifted);
};

TEST(PositionFit, BringsALiftedVertexBackToThePlane) {
  LiftedFit lifted(0.1);
  auto& [plate, change, fit, start] = lifted;
  fit.gather(change);
  const PositionFit::Fit first = fit.fit(change, start);
  const double height = 0.1 * plate.volume->frame().scale();
  EXPECT_GT(first.energy, 0);
  EXPECT_LT(std::abs(first.position.z - start.z + height), 0.05 * height) << "a plane is met in one step";
  EXPECT_LT(glm::length(glm::dvec2(first.position - start)), 0.05 * height) << "and nothing pulls it sideways";

  const double inside = 2 * first.deviation, beyond = 0.5 * first.deviation;
  EXPECT_EQ(fit.fit(change, start, inside).position, first.position);
  EXPECT_GT(fit.fit(change, start, beyond).deviation, beyond);
  EXPECT_EQ(fit.fit(change, start, beyond).position, start) << "is given up";

  ASSERT_TRUE(change.prepare_relocate(kLifted, {first.position, first.position}));
  EXPECT_LT(fit.fit(change, first.position).energy, 1e-3 * first.energy);
}

TEST(PositionFit, ADeviationOfAFaceCountsByTheRootOfItsShare) {
  const auto deviation = [](double share) {
    LiftedFit lifted(0.1, share);
    lifted.fit.gather(lifted.change);
    return lifted.fit.fit(lifted.change, lifted.start).deviation;
  };
  const double whole = deviation(1);
  EXPECT_NEAR(deviation(0.25), 2 * whole, 1e-9 * whole);
  EXPECT_TRUE(std::isfinite(deviation(0)));
}

// The tries at a vertex with very many faces are rationed by it.
TEST(PositionFit, CountsThePointsThatItLooksAt) {
  LiftedFit lifted(0.1);
  auto& [plate, change, fit, start] = lifted;
  EXPECT_EQ(fit.looked_at(), 0u);
  fit.fit(change, start);
  const std::size_t faces_alone = fit.looked_at();
  EXPECT_GE(faces_alone, 6u * 10) << "six faces";
  fit.gather(change);
  fit.begin();
  fit.fit(change, start);
  EXPECT_GT(fit.looked_at(), faces_alone) << "pieces come on top";
  fit.begin();
  EXPECT_EQ(fit.looked_at(), 0u);
}

TEST(PositionFit, StaysWhereNothingDeviates) {
  LiftedFit lifted(0);
  auto& [plate, change, fit, start] = lifted;
  fit.gather(change);
  const PositionFit::Fit at_rest = fit.fit(change, start);
  EXPECT_LT(at_rest.energy, 1e-9);
  EXPECT_LT(glm::length(at_rest.position - start), 0.02);
}

}  // namespace
