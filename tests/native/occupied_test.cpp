// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/occupied.h"

#include <gtest/gtest.h>

#include "check/certificate.h"
#include "decimation/certified_bounds.h"
#include "decimation/change_trial.h"
#include "decimation/regions.h"
#include "shapes.h"
#include "topology/manifold_cut.h"

namespace {

using namespace tolvol;
using glm::dvec3;

TEST(Occupied, HoldsAPlaceUntilTheLastHasLeftIt) {
  Occupied occupied;
  EXPECT_FALSE(occupied.contains({0, 1, 2}));
  occupied.add({0, 1, 2}), occupied.add({-0.0, 1, 2});
  EXPECT_TRUE(occupied.contains({0, 1, 2}));
  EXPECT_FALSE(occupied.contains({0, 2, 1}));
  occupied.remove({0, 1, 2});
  EXPECT_TRUE(occupied.contains({0, 1, 2}));
  occupied.remove({-0.0, 1, 2});
  EXPECT_FALSE(occupied.contains({0, 1, 2}));
}

TEST(Occupied, APlaceThatVeryManyHaveHadStaysOccupied) {
  constexpr int kMany = 70'000;
  Occupied occupied;
  for (int i = 0; i < kMany; ++i) occupied.add({0, 1, 2}), occupied.add({double(i), 0, 0});
  for (int i = 0; i < kMany; ++i) {
    EXPECT_TRUE(occupied.contains({0, 1, 2}));
    occupied.remove({0, 1, 2}), occupied.remove({double(i), 0, 0});
    EXPECT_FALSE(occupied.contains({double(i), 0, 0}));
  }
  EXPECT_TRUE(occupied.contains({0, 1, 2}));
}

TEST(Occupied, NoVertexIsPutWhereAnotherIs) {
  // Two flat sheets, one close above the other: nothing but the other sheet's vertex is in the way.
  constexpr unsigned kSide = 8;
  constexpr std::uint32_t kMiddle = (kSide / 2) * (kSide + 1) + kSide / 2;
  TriangleMesh lower = shapes::grid(kSide), upper;
  for (dvec3& p : lower.vertices) p.z = 0;
  upper = lower;
  for (dvec3& p : upper.vertices) p.z = 0.001;
  const std::uint32_t above = kMiddle + static_cast<std::uint32_t>(lower.vertices.size());
  const TriangleMesh both = shapes::joined(lower, upper);

  const StoredSpace world(glm::dmat4(1), Storage::float64);
  const ToleranceVolume volume(both.vertices, both.triangles, world, 0.05);
  const StoredSpace space = world.in(volume.frame());
  const double limit = volume.frame_tolerance();
  const TriangleCertificate certificate(volume.witnesses(), volume.grid(), volume.hierarchy(), limit, limit);
  Team alone(1);
  BoundedMeshInput input;
  input.triangles = both.triangles;
  input.mates = cut_to_manifold(both.vertices, both.triangles, alone).mates;
  for (std::uint32_t v = 0; v < both.vertices.size(); ++v) {
    input.positions.push_back({both.vertices[v], space.frame(both.vertices[v])});
    input.slots.push_back(v);
  }
  input.pinned.assign(both.vertices.size(), false);
  input.store = [&](const dvec3& p) { return VertexPosition{space.store(p), p}; };
  const std::vector<dvec3> positions = space.frame(both.vertices);
  CertifiedBounds bounds({certificate}, MeshView{both.triangles, positions}, alone);
  BoundedMesh mesh(std::move(input), &bounds, alone);

  // The edge that runs along x to a vertex collapses into the vertex, which goes to a place.
  const auto collapse = [&](std::uint32_t vertex, const VertexPosition& target, bool carry_out = false) {
    const auto h = mesh.connectivity().find_halfedge(BoundedMesh::handle(vertex - 1), BoundedMesh::handle(vertex));
    ChangeTrial trial(mesh, nullptr);
    trial.begin();
    const ChangeTrial::Outcome outcome = trial.try_collapse(h, target);
    if (carry_out) trial.carry_out(mesh);
    return std::pair(outcome, trial.met_another());
  };
  const VertexPosition taken = mesh.vertex_position(above), here = mesh.vertex_position(kMiddle);
  const auto to = [&](const VertexPosition& target) { return collapse(kMiddle, target); };
  EXPECT_EQ(to(taken), std::pair(ChangeTrial::Outcome::possible, false)) << "as long as nothing keeps them apart";
  mesh.keep_apart();
  EXPECT_EQ(to(taken), std::pair(ChangeTrial::Outcome::refused, true));
  EXPECT_EQ(to(here), std::pair(ChangeTrial::Outcome::possible, false)) << "where it is itself";

  const dvec3 aside = taken.position + dvec3(0.1 * limit, 0, 0);
  ASSERT_EQ(collapse(above, mesh.store(aside), true).first, ChangeTrial::Outcome::possible);
  EXPECT_EQ(to(taken), std::pair(ChangeTrial::Outcome::possible, false)) << "the place is free again";
  EXPECT_EQ(to(mesh.vertex_position(above)), std::pair(ChangeTrial::Outcome::refused, true));

  const Regions regions(mesh, 120, 0.3, alone);
  ASSERT_EQ(regions.count(), 2u);
  ASSERT_NE(regions.of_vertex(kMiddle), Regions::kNone);
  mesh.keep_apart(regions, alone);
  EXPECT_EQ(to(taken), std::pair(ChangeTrial::Outcome::possible, false)) << "in regions, the place is free";
  EXPECT_EQ(to(mesh.vertex_position(above)), std::pair(ChangeTrial::Outcome::refused, true)) << "in regions";
}

}  // namespace
