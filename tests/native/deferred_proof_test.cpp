// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/deferred_proof.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "check/certificate.h"
#include "decimation/collapse_loop.h"
#include "measure/hausdorff.h"
#include "shapes.h"
#include "topology/manifold_cut.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// A square, with a row of triangles at one of its sides that have no other neighbour.
TriangleMesh square_with_ears() {
  constexpr unsigned kSquares = 44;
  TriangleMesh mesh = shapes::grid(kSquares);
  for (unsigned j = 0; j < kSquares; ++j) {
    mesh.triangles.emplace_back(j, j + 1, unsigned(mesh.vertices.size()));
    mesh.vertices.emplace_back(-0.001, (j + 0.5) / kSquares, 0);
  }
  return mesh;
}

/// A mesh that is its own reference, with seams across it, and the regions that it is cut into.
struct Worked {
  explicit Worked(double tolerance, bool subset = false) {
    reference = square_with_ears();
    for (dvec3& p : reference.vertices) p.z = 0.05 * std::sin(9 * p.x) * std::cos(7 * p.y);
    volume.emplace(reference.vertices, reference.triangles, StoredSpace(glm::dmat4(1), Storage::float64), tolerance,
                   ToleranceVolume::Options{.precision = 2});
    space = StoredSpace(glm::dmat4(1), Storage::float64).in(volume->frame());
    const double limit = volume->frame_tolerance() * (1 - 1e-9);
    certificate.emplace(volume->witnesses(), volume->grid(), volume->hierarchy(), limit, limit);
    coverage.emplace(volume->reference(), limit, reference.triangles.size());
    for (std::uint32_t i = 0; i < reference.triangles.size(); ++i) coverage->set_witness(i, i);
    BoundedMeshInput input;
    Team alone(1);
    input.triangles = reference.triangles;
    input.mates = cut_to_manifold(reference.vertices, reference.triangles, alone).mates;
    for (std::uint32_t v = 0; v < reference.vertices.size(); ++v) {
      input.positions.push_back({reference.vertices[v], space->frame(reference.vertices[v])});
      input.slots.push_back(v);
      input.shares.push_back(v % 5 == 0 ? 0.5 : 1);
    }
    for (const glm::uvec3& t : reference.triangles) {
      const dvec3 centre = (reference.vertices[t.x] + reference.vertices[t.y] + reference.vertices[t.z]) / 3.0;
      input.wedges.push_back(t + glm::uvec3(centre.x > 0.5 ? std::uint32_t(reference.vertices.size()) : 0));
    }
    input.pinned.assign(reference.vertices.size(), false);
    input.pinned[40] = true;
    input.subset = subset;
    input.store = [this](const dvec3& p) {
      const dvec3 stored = space->store(p);
      return VertexPosition{stored, space->frame(stored)};
    };
    facing.emplace(volume->reference(), 1e-15, 1e-15, std::numbers::pi / 2, alone);
    CertifiedBounds::Directions directions{*certificate, &*coverage};
    directions.facing = &*facing;
    bounds.emplace(directions, MeshView{reference.triangles, positions()}, alone, own_triangles());
    mesh.emplace(std::move(input), &*bounds, alone);
    collapse.emplace(*mesh, alone);
    shared.emplace(*collapse);
    parts.emplace(*mesh, 1200, 0.5, alone);
    vertices.resize(parts->count()), faces.resize(parts->count());
    for (std::uint32_t v = 0; v < reference.vertices.size(); ++v) {
      if (parts->of_vertex(v) != Regions::kNone) vertices[parts->of_vertex(v)].push_back(v);
    }
    for (std::uint32_t f = 0; f < reference.triangles.size(); ++f) {
      const glm::uvec3& t = reference.triangles[f];
      const std::uint32_t part = std::min({parts->of_vertex(t.x), parts->of_vertex(t.y), parts->of_vertex(t.z)});
      if (part != Regions::kNone) faces[part].push_back(f);
    }
    places.resize(reference.triangles.size());
  }

  std::vector<dvec3> positions() const { return space->frame(reference.vertices); }
  std::vector<std::uint32_t> own_triangles() const {
    std::vector<std::uint32_t> triangles(reference.triangles.size());
    std::iota(triangles.begin(), triangles.end(), 0u);
    return triangles;
  }

  DeferredProof later(std::uint32_t region) {
    return DeferredProof(*collapse, *mesh, nullptr, vertices[region], faces[region], places);
  }

  /// Collapses a region, up to edges of a cost; on trust if there is something to note it in.
  void work(std::uint32_t region, DeferredProof* later, double cost) {
    CollapseLoop loop(*shared, *parts, region, nullptr, later);
    for (std::uint32_t e = 0; e < mesh->connectivity().n_edges(); ++e) {
      if (parts->of_edge(*mesh, e) == region) loop.add(e, collapse->cost(e));
    }
    loop.run({cost, 0}, nullptr);
  }

  TriangleMesh now() const {
    TriangleMesh out;
    for (std::uint32_t v = 0; v < reference.vertices.size(); ++v) out.vertices.push_back(mesh->stored(v));
    for (std::uint32_t f = 0; f < reference.triangles.size(); ++f) {
      if (mesh->alive(f)) out.triangles.push_back(mesh->triangle(f));
    }
    return out;
  }

  TriangleMesh reference;
  std::optional<StoredSpace> space;
  std::optional<ToleranceVolume> volume;
  std::optional<TriangleCertificate> certificate;
  std::optional<Coverage> coverage;
  std::optional<FacingRule> facing;
  std::optional<CertifiedBounds> bounds;
  std::optional<BoundedMesh> mesh;
  std::optional<EdgeCollapse> collapse;
  std::optional<CollapseLoop::Shared> shared;
  std::optional<Regions> parts;
  std::vector<std::vector<std::uint32_t>> vertices, faces;  // of each region
  std::vector<std::uint32_t> places;
};

void expect_same(const BoundedMesh& a, const BoundedMesh& b) {
  const OpenMesh::TriConnectivity &x = a.connectivity(), &y = b.connectivity();
  for (int i = 0; i < int(x.n_vertices()); ++i) {
    const OpenMesh::VertexHandle v(i);
    ASSERT_EQ(x.status(v).deleted(), y.status(v).deleted());
    ASSERT_EQ(x.halfedge_handle(v), y.halfedge_handle(v)) << "of vertex " << i;
    ASSERT_EQ(a.survivor(std::uint32_t(i)), b.survivor(std::uint32_t(i)));
    ASSERT_EQ(a.position(std::uint32_t(i)), b.position(std::uint32_t(i)));
    ASSERT_EQ(a.left_original(std::uint32_t(i)), b.left_original(std::uint32_t(i)));
    const auto &p = a.certified()->vertex_bound(std::uint32_t(i)), &q = b.certified()->vertex_bound(std::uint32_t(i));
    ASSERT_EQ(p.distance, q.distance);
    ASSERT_EQ(p.triangle, q.triangle);
    ASSERT_EQ(a.share(std::uint32_t(i)), b.share(std::uint32_t(i)));
  }
  for (int i = 0; i < int(x.n_halfedges()); ++i) {
    const OpenMesh::HalfedgeHandle h(i);
    ASSERT_EQ(x.status(h).deleted(), y.status(h).deleted());
    ASSERT_EQ(x.next_halfedge_handle(h), y.next_halfedge_handle(h)) << "of halfedge " << i;
    ASSERT_EQ(x.prev_halfedge_handle(h), y.prev_halfedge_handle(h)) << "of halfedge " << i;
    ASSERT_EQ(x.to_vertex_handle(h), y.to_vertex_handle(h)) << "of halfedge " << i;
    ASSERT_EQ(x.face_handle(h), y.face_handle(h)) << "of halfedge " << i;
  }
  for (int i = 0; i < int(x.n_edges()); ++i) {
    ASSERT_EQ(x.status(OpenMesh::EdgeHandle(i)).deleted(), y.status(OpenMesh::EdgeHandle(i)).deleted());
  }
  for (int i = 0; i < int(x.n_faces()); ++i) {
    const OpenMesh::FaceHandle f(i);
    ASSERT_EQ(x.status(f).deleted(), y.status(f).deleted());
    ASSERT_EQ(x.halfedge_handle(f), y.halfedge_handle(f)) << "of face " << i;
    const FaceBound &p = a.certified()->face_bound(std::uint32_t(i)), &q = b.certified()->face_bound(std::uint32_t(i));
    ASSERT_EQ(p.distance, q.distance);
    ASSERT_EQ(p.angle, q.angle);
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(a.corner_source(std::uint32_t(i), k), b.corner_source(std::uint32_t(i), k));
    }
  }
}

constexpr double kTolerance = 0.004;

double fourth_power_of_tolerance() { return std::pow(Worked(kTolerance).certificate->limit(), 4); }

TEST(DeferredProof, HoldsOnlyWithinTheTolerance) {
  const double unit = fourth_power_of_tolerance();
  int holding = 0, failing = 0;
  for (const double share : {0.0, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e6}) {
    Worked worked(kTolerance);
    DeferredProof later = worked.later(0);
    ASSERT_TRUE(later.possible());
    worked.work(0, &later, share * unit);
    const bool holds = later.holds(nullptr);
    const TriangleMesh now = worked.now();
    const double forward = hausdorff(now, worked.reference, {kTolerance, 1, nullptr}).lower,
                 backward = hausdorff(worked.reference, now, {kTolerance, 1, nullptr}).lower;
    if (std::max(forward, backward) > kTolerance) {
      EXPECT_FALSE(holds) << "up to a cost of " << share;
    }
    (holds ? holding : failing) += now.triangles.size() < worked.reference.triangles.size();
  }
  EXPECT_GE(holding, 3) << "collapses were proved together";
  EXPECT_GE(failing, 3) << "and some could not be";
}

class TakesBack : public testing::TestWithParam<bool> {};

TEST_P(TakesBack, Everything) {
  const double unit = fourth_power_of_tolerance();
  int taken_back = 0;
  for (const double share : {1.0, 10.0, 100.0, 1e3, 1e4, 1e6}) {
    Worked worked(kTolerance, GetParam()), untouched(kTolerance, GetParam());
    {
      DeferredProof later = worked.later(0);
      worked.work(0, &later, share * unit);
      if (later.holds(nullptr)) continue;
      later.take_back();
      ++taken_back;
    }
    ASSERT_EQ(worked.mesh->triangle_count(), untouched.mesh->triangle_count());
    expect_same(*worked.mesh, *untouched.mesh);
    // What cannot be seen, pieces and quadrics, decides what further collapses come to.
    for (Worked* w : {&worked, &untouched}) w->work(0, nullptr, EdgeCollapse::kNever);
    expect_same(*worked.mesh, *untouched.mesh);
    EXPECT_EQ(worked.now().triangles, untouched.now().triangles);
    EXPECT_LT(worked.mesh->triangle_count(), worked.reference.triangles.size());
  }
  EXPECT_GE(taken_back, 3);
}

TEST_P(TakesBack, RegionsThatMeetAtABoundary) {
  Worked worked(kTolerance, GetParam()), untouched(kTolerance, GetParam());
  std::vector<DeferredProof> later;
  for (std::uint32_t part = 0; part < worked.parts->count(); ++part) later.push_back(worked.later(part));
  for (std::uint32_t part = 0; part < worked.parts->count(); ++part) {
    worked.work(part, &later[part], EdgeCollapse::kNever);
  }
  EXPECT_LT(worked.mesh->triangle_count(), worked.reference.triangles.size() / 4);
  for (DeferredProof& one : later) one.take_back();
  ASSERT_EQ(worked.mesh->triangle_count(), untouched.mesh->triangle_count());
  expect_same(*worked.mesh, *untouched.mesh);
}

INSTANTIATE_TEST_SUITE_P(DeferredProof, TakesBack, testing::Bool(),
                         [](const auto& subset) { return subset.param ? "Subset" : "AnyPosition"; });

TEST(DeferredProof, LeavesBoundariesWithBoundsToOthers) {
  Worked worked(kTolerance);
  CertifiedBounds::Directions directions{*worked.certificate};
  directions.boundary_forward = &*worked.certificate, directions.boundary_backward = &*worked.coverage;
  Team alone(1);
  CertifiedBounds bounds(directions, MeshView{worked.reference.triangles, worked.positions()}, alone,
                         worked.own_triangles());
  BoundedMeshInput input;
  input.triangles = worked.reference.triangles;
  input.mates = cut_to_manifold(worked.reference.vertices, worked.reference.triangles, alone).mates;
  for (std::uint32_t v = 0; v < worked.reference.vertices.size(); ++v) {
    input.positions.push_back({worked.mesh->stored(v), worked.mesh->position(v)});
    input.slots.push_back(v);
  }
  input.pinned.assign(worked.reference.vertices.size(), false);
  BoundedMesh mesh(std::move(input), &bounds, alone);
  EdgeCollapse collapse(mesh, alone);
  EXPECT_FALSE(DeferredProof(collapse, mesh, nullptr, worked.vertices[0], worked.faces[0], worked.places).possible());
}

}  // namespace
