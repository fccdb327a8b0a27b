// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/occupied.h"

#include <gtest/gtest.h>

#include "certified_mesh.h"
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

// Vertices at the rim of a region belong to none, and are in the cells of several.
TEST(BoundedMesh, ARegionKnowsThePlacesOfAllVerticesInItsCell) {
  const TriangleMesh plate = shapes::grid(40);
  CertifiedMesh c(plate, plate.vertices, 0.1);
  Team three(3);
  const Regions regions(*c.mesh, 300, 0.4, three);
  ASSERT_GE(regions.count(), 4u);
  c.mesh->keep_apart(regions, three);
  std::vector<std::uint32_t> members(regions.count(), Regions::kNone);  // of each region a vertex
  for (std::uint32_t v = 0; v < plate.vertices.size(); ++v) {
    if (regions.of_vertex(v) != Regions::kNone) members[regions.of_vertex(v)] = v;
  }
  int at_rim = 0;
  for (std::uint32_t v = 0; v < plate.vertices.size(); ++v) {
    at_rim += regions.of_vertex(v) == Regions::kNone;
    Box place;
    place.add(c.mesh->stored(v));
    regions.for_each_meeting(place, [&](std::uint32_t region) {
      const std::uint32_t u = members[region];
      ASSERT_NE(u, Regions::kNone);
      EXPECT_EQ(c.mesh->meets_another(c.mesh->vertex_position(v), u, u), v != u);
    });
  }
  EXPECT_GT(at_rim, 40);
}

}  // namespace
