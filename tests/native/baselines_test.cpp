// SPDX-License-Identifier: GPL-3.0-or-later
// The decimation with other methods in charge: each must decide, and keep exactly what it is about.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "base/errors.h"
#include "baselines/checked_ring.h"
#include "baselines/permission_ring.h"
#include "baselines/vertex_samples.h"
#include "check/changed_faces.h"
#include "check/methods.h"
#include "decimation/decimation.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "shapes.h"
#ifdef TOLVOL_GL
#include "gl_fixture.h"
#endif

namespace {

using namespace tolvol;
using glm::dvec3;

struct Decimated {
  TriangleMesh mesh;
  std::string method, renderer;
};

constexpr double kTolerance = 0.03;
const StoredSpace kSpace{glm::dmat4(1), Storage::float32};

Decimated by(RingCheck& baseline, const TriangleMesh& mesh, const ToleranceVolume& volume,
             DecimationOptions options = {}) {
  options.baseline = &baseline;
  DecimationResult r = decimate(mesh.vertices, mesh.triangles, kSpace, &volume, options);
  return {{std::move(r.vertices), std::move(r.triangles)}, r.method, r.renderer};
}

ToleranceVolume volume_of(const TriangleMesh& mesh) {
  return ToleranceVolume(mesh.vertices, mesh.triangles, kSpace, kTolerance);
}

struct Fixed final : RingCheck {
  explicit Fixed(bool answer) : answer(answer) {}
  void begin(const TriangleMesh& mesh, const StoredSpace&) override { triangles = mesh.triangles.size(); }
  struct Asking final : Trial {
    explicit Asking(Fixed& fixed) : fixed(fixed) {}
    bool accepts(const ChangedFaces& change) override {
      for (const Coverage::Element& face : change.elements()) EXPECT_LT(face.id, fixed.triangles);
      for (const Coverage::Removed& face : change.removed()) EXPECT_LT(face.id, fixed.triangles);
      return ++fixed.questions, fixed.answer;
    }
    void commit(const ChangedFaces&) override { ++fixed.commits; }
    Fixed& fixed;
  };
  std::unique_ptr<Trial> trial() override { return std::make_unique<Asking>(*this); }
  std::string method() const override { return "fixed"; }

  bool answer;
  std::size_t triangles = 0, questions = 0, commits = 0;
};

TEST(Baselines, DecideAlone) {
  const TriangleMesh mesh = shapes::torus(24);
  const ToleranceVolume volume = volume_of(mesh);
  Fixed no(false), yes(true);
  const Decimated all = by(no, mesh, volume), few = by(yes, mesh, volume);
  EXPECT_EQ(all.mesh.triangles.size(), mesh.triangles.size());
  EXPECT_GT(no.questions, mesh.triangles.size());
  EXPECT_EQ(no.commits, 0u);
  EXPECT_EQ(few.mesh.triangles.size(), mesh.triangles.size() - 2 * yes.commits);
  EXPECT_GT(hausdorff(few.mesh, mesh, {std::nullopt, 1, nullptr}).lower, kTolerance) << "nothing else holds it";
  EXPECT_EQ(few.method, "fixed");
  EXPECT_EQ(few.renderer, "CPU");
}

TEST(Baselines, NeedAVolume) {
  const TriangleMesh mesh = shapes::torus(8);
  Fixed yes(true);
  DecimationOptions options;
  options.baseline = &yes, options.target_triangles = 50;
  EXPECT_THROW(decimate(mesh.vertices, mesh.triangles, kSpace, nullptr, options), InvalidInput);
}

void expect_kept(const std::string& method) {
  const TriangleMesh mesh = shapes::torus(40, 0.004);
  const ToleranceVolume volume(mesh.vertices, mesh.triangles, kSpace, kTolerance, {.precision = 4.0});
  const auto check = make_check(method, volume);
  baselines::CheckedRing ring(*check);
  const Decimated result = by(ring, mesh, volume);
  EXPECT_LT(result.mesh.triangles.size(), 600u) << method;
  EXPECT_LE(hausdorff(result.mesh, mesh, {.bound = kTolerance, .threads = 1, .narrow = false}).upper, kTolerance)
      << method;
  EXPECT_EQ(result.method, check->method());
  EXPECT_EQ(result.renderer, check->renderer());
}

TEST(CheckedRing, KeepsWhatTheCertificateProves) { expect_kept("certificate"); }

#ifdef TOLVOL_GL
using CheckedRingGl = GlTest;

TEST_F(CheckedRingGl, KeepsWhatTheGpuProves) {
  expect_kept("gl_certificate");
  expect_kept("occlusion_query");
}
#endif

double farthest_vertex(const TriangleMesh& from, const TriangleMesh& to) {
  const Hierarchy hierarchy(to);
  double farthest = 0;
  for (const dvec3& p : from.vertices) farthest = std::max(farthest, hierarchy.nearest(p).distance);
  return farthest;
}

TEST(VertexSamples, KeepVerticesAndNoMore) {
  const TriangleMesh mesh = shapes::torus(across(60), 0.004);
  const ToleranceVolume volume = volume_of(mesh);
  for (const auto placement : {DecimationOptions::Placement::optimal, DecimationOptions::Placement::subset}) {
    baselines::VertexSamples samples(volume.frame_tolerance());
    DecimationOptions options;
    options.placement = placement;
    const Decimated result = by(samples, mesh, volume, options);
    EXPECT_LT(result.mesh.triangles.size(), 400u);
    const double farthest = farthest_vertex(mesh, result.mesh);
    EXPECT_LE(farthest, kTolerance * (1 + 1e-9));
    EXPECT_GT(farthest, 0.9 * kTolerance);
    EXPECT_GT(hausdorff(result.mesh, mesh, {std::nullopt, 1, nullptr}).lower, kTolerance) << "the other direction";
  }
}

/// Clips the triangle by the six planes of a box and tells whether something is left.
bool overlaps(const dvec3 (&corners)[3], const dvec3& low, double edge) {
  std::vector<dvec3> polygon(corners, corners + 3);
  for (int plane = 0; plane < 6 && !polygon.empty(); ++plane) {
    const int axis = plane % 3;
    const double sign = plane < 3 ? 1 : -1, at = low[axis] + (plane < 3 ? 0 : edge);
    std::vector<dvec3> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const dvec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double da = sign * (a[axis] - at), db = sign * (b[axis] - at);
      if (da >= 0) kept.push_back(a);
      if ((da < 0) != (db < 0)) kept.push_back(a + (b - a) * (da / (da - db)));
    }
    polygon = std::move(kept);
  }
  return !polygon.empty();
}

TEST(PermissionRing, PermitsExactlyWhatOverlapsPermittedCellsAlone) {
  const baselines::PermissionGrid grid(shapes::torus(40), 0.15, 5);
  std::mt19937 engine(1);
  std::uniform_real_distribution<double> around(-1.5, 1.5), exponent(-2.5, 0);
  std::normal_distribution<double> normal;
  std::size_t permitted = 0, refused_between = 0;
  for (int i = 0; i < 150000; ++i) {
    const double size = 0.8 * std::pow(10, exponent(engine));
    const dvec3 middle(around(engine), around(engine), 0.4 * around(engine));
    dvec3 corners[3];
    for (dvec3& c : corners) c = middle + size * dvec3(normal(engine), normal(engine), normal(engine));
    if (i % 5 == 0) corners[2] = corners[i % 2];                         // a segment
    if (i % 7 == 0) corners[0].z = corners[1].z = corners[2].z = 0.123;  // parallel to two axes
    bool inside = true, corners_inside = true;
    for (const dvec3& c : corners) corners_inside &= grid.permits(grid.cell_of(c));
    if (!corners_inside) {
      ASSERT_FALSE(permits(grid, corners)) << i;
      continue;
    }
    const glm::ivec3 low =
        glm::min(glm::min(grid.cell_of(corners[0]), grid.cell_of(corners[1])), grid.cell_of(corners[2]));
    const glm::ivec3 high =
        glm::max(glm::max(grid.cell_of(corners[0]), grid.cell_of(corners[1])), grid.cell_of(corners[2]));
    for (int z = low.z; z <= high.z && inside; ++z) {
      for (int y = low.y; y <= high.y && inside; ++y) {
        for (int x = low.x; x <= high.x && inside; ++x) {
          const glm::ivec3 cell(x, y, z);
          inside =
              grid.permits(cell) || !overlaps(corners, grid.origin() + dvec3(cell) * grid.spacing(), grid.spacing());
        }
      }
    }
    ASSERT_EQ(permits(grid, corners), inside) << i;
    ++(inside ? permitted : refused_between);
  }
  EXPECT_GT(permitted, 1000u);
  EXPECT_GT(refused_between, 1000u);
}

TEST(PermissionRing, RefusesWhatIsOutsideTheGrid) {
  const baselines::PermissionGrid grid(shapes::grid(8), 0.1, 4);
  const dvec3 inside[3] = {{0.1, 0.1, 0}, {0.9, 0.1, 0}, {0.1, 0.9, 0.01}};
  EXPECT_TRUE(permits(grid, inside));
  const dvec3 far_away[3] = {{0.1, 0.1, 0}, {0.9, 0.1, 0}, {0.1, 50, 0}};
  EXPECT_FALSE(permits(grid, far_away));
}

TEST(PermissionRing, KeepsTheTolerance) {
  const TriangleMesh mesh = shapes::torus(across(60), 0.004);
  const ToleranceVolume volume = volume_of(mesh);
  std::size_t before = mesh.triangles.size();
  for (const double precision : {2.0, 4.0, 8.0}) {
    if (kSanitized && precision > 4) break;
    const baselines::PermissionGrid grid(volume.reference(), volume.frame_tolerance(), precision);
    baselines::PermissionRing ring(grid);
    const Decimated result = by(ring, mesh, volume);
    EXPECT_LE(hausdorff(result.mesh, mesh, {.bound = kTolerance, .threads = 1, .narrow = false}).upper, kTolerance);
    EXPECT_LT(result.mesh.triangles.size(), before) << "a finer grid loses less of the tolerance";
    before = result.mesh.triangles.size();
  }
}

}  // namespace
