// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/patch_trial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "certified_mesh.h"
#include "many.h"
#include "measure/hausdorff.h"

namespace {

using namespace tolvol;
using glm::dvec3;

struct Hostile {
  const char* name;
  TriangleMesh mesh;
  double tolerance;
};

/// Manifolds on which a proposal is likely to be wrong.
std::vector<Hostile> hostile(unsigned seed) {
  std::minstd_rand random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / static_cast<double>(std::minstd_rand::max()); };
  TriangleMesh slivers = shapes::grid(12), spikes = slivers, folded = slivers, needles = slivers, rough = slivers;
  for (dvec3& p : slivers.vertices) p = {p.x, 0.02 * p.y, 0.05 * std::sin(9 * p.x)};
  for (dvec3& p : spikes.vertices) p.z = uniform() < 0.1 ? 0.4 * uniform() : 0;
  for (dvec3& p : folded.vertices) p = {0.2 * std::sin(4 * p.x), p.y, 0.2 * std::cos(4 * p.x) + 0.02 * p.x};
  for (dvec3& p : needles.vertices) p = {p.x + 0.3 * p.y, 1e-3 * p.y + 0.02 * p.x * p.x, 0.1 * uniform() * p.y};
  for (dvec3& p : rough.vertices) p += dvec3(0.03 * uniform(), 0.03 * uniform(), 0.1 * uniform());
  TriangleMesh ball = shapes::sphere(10), tube = shapes::torus(12, 0.02, seed);
  return {{"slivers", slivers, 0.02}, {"spikes", spikes, 0.1}, {"folded", folded, 0.03}, {"needles", needles, 0.01},
          {"rough", rough, 0.05},     {"ball", ball, 0.08},    {"tube", tube, 0.08}};
}

/// The number of tries: 200 in every run, 5,000 where the environment asks for all.
int tries() { return is_full_run() ? 5000 : many(200); }

TEST(PatchTrial, WhatItFindsPossibleKeepsBothDirections) {
  int tried = 0, possible = 0, judged = 0;
  for (unsigned seed = 1; tried < tries(); ++seed) {
    for (const Hostile& h : hostile(seed)) {
      CertifiedMesh c(h.mesh, h.mesh.vertices, h.tolerance);
      SurfaceSamples samples(*c.mesh, c.team);
      PatchTrial trial(*c.mesh, samples, nullptr);
      std::minstd_rand random(seed);
      int here = 0;
      for (int i = 0; i < 40; ++i) {
        const auto e = static_cast<std::uint32_t>(random() % c.mesh->connectivity().n_edges());
        if (c.mesh->connectivity().status(BoundedMesh::edge(e)).deleted()) continue;
        const std::optional<PatchTrial::Price> price = trial.price(BoundedMesh::edge(e));
        if (!price) continue;
        ++tried;
        const std::size_t before = c.mesh->triangle_count();
        if (!trial.try_collapse(*price, {2 + i % 3, i % 5 == 0, i % 2 == 0})) {
          EXPECT_EQ(c.mesh->triangle_count(), before);
          continue;
        }
        trial.carry_out(*c.mesh);
        EXPECT_EQ(c.mesh->triangle_count(), before - trial.removed().size());
        for (const Patch::Face& f : trial.patch().faces()) samples.renew(*c.mesh, f.id);
        for (const Coverage::Removed& r : trial.removed()) samples.renew(*c.mesh, r.id);
        ++possible, ++here;
      }
      if (here == 0) continue;
      const TriangleMesh now = c.now();
      EXPECT_LE(hausdorff(now, c.reference, {h.tolerance, 1, nullptr}).upper, h.tolerance) << h.name << " forward";
      EXPECT_LE(hausdorff(c.reference, now, {h.tolerance, 1, nullptr}).upper, h.tolerance) << h.name << " backward";
      ++judged;
    }
  }
  EXPECT_GT(possible, tried / 10);
  EXPECT_GT(judged, 4);
}

TEST(PatchTrial, ManyStartsSucceedWhereOneFails) {
  int one = 0, many_starts = 0;
  for (const Hostile& h : hostile(1)) {
    CertifiedMesh c(h.mesh, h.mesh.vertices, h.tolerance);
    SurfaceSamples samples(*c.mesh, c.team);
    PatchTrial trial(*c.mesh, samples, nullptr);
    for (std::uint32_t e = 0; e < c.mesh->connectivity().n_edges(); e += 3) {
      const std::optional<PatchTrial::Price> price = trial.price(BoundedMesh::edge(e));
      if (!price) continue;
      const bool possible = trial.try_collapse(*price, {2, false, false});
      const double reached = trial.reached();
      const bool possible_with_many = trial.try_collapse(*price, {2, true, false});
      EXPECT_GE(possible_with_many, possible);
      EXPECT_TRUE(possible || trial.reached() == reached) << "it is that of the first start";
      one += possible, many_starts += possible_with_many;
    }
  }
  EXPECT_GT(many_starts, one);
}

TEST(PatchTrial, MovesNoVertexThatHasToStay) {
  const TriangleMesh sphere = shapes::sphere(10);
  std::vector<bool> pinned(sphere.vertices.size(), false);
  for (std::size_t v = 0; v < pinned.size(); v += 3) pinned[v] = true;
  CertifiedMesh c(sphere, sphere.vertices, 0.1, pinned);
  SurfaceSamples samples(*c.mesh, c.team);
  PatchTrial trial(*c.mesh, samples, nullptr);
  int possible = 0;
  for (std::uint32_t e = 0; e < c.mesh->connectivity().n_edges(); ++e) {
    if (c.mesh->connectivity().status(BoundedMesh::edge(e)).deleted()) continue;
    const std::optional<PatchTrial::Price> price = trial.price(BoundedMesh::edge(e));
    if (!price || !trial.try_collapse(*price, {2, false, false})) continue;
    trial.carry_out(*c.mesh);
    ++possible;
  }
  EXPECT_GT(possible, 10);
  for (std::uint32_t v = 0; v < sphere.vertices.size(); ++v) {
    if (!pinned[v]) continue;
    EXPECT_EQ(c.mesh->stored(v), sphere.vertices[v]);
    EXPECT_EQ(c.mesh->survivor(v), v);
  }
}

TEST(PatchTrial, PricesRiseWithTheDamage) {
  // A plate that is flat but for one peak: collapsing the peak costs, collapsing anything far from it costs nothing.
  TriangleMesh plate = shapes::grid(10);
  const std::uint32_t peak = 5 * 11 + 5;
  for (std::uint32_t v = 0; v < plate.vertices.size(); ++v) plate.vertices[v].z = v == peak ? 0.3 : 0;
  CertifiedMesh c(plate, plate.vertices, 0.1);
  SurfaceSamples samples(*c.mesh, c.team);
  PatchTrial trial(*c.mesh, samples, nullptr);
  const auto edge = [&](std::uint32_t from, std::uint32_t to) {
    const auto& connectivity = c.mesh->connectivity();
    return connectivity.edge_handle(connectivity.find_halfedge(BoundedMesh::handle(from), BoundedMesh::handle(to)));
  };
  const auto flat = trial.price(edge(2 * 11 + 2, 2 * 11 + 3)), at_peak = trial.price(edge(peak - 1, peak));
  ASSERT_TRUE(flat && at_peak);
  EXPECT_LT(flat->largest, 0.01);
  EXPECT_LT(flat->rise, 1e-6);
  EXPECT_GT(at_peak->rise, flat->rise);
}

}  // namespace
