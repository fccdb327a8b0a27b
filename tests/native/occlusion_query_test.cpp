// SPDX-License-Identifier: GPL-3.0-or-later
// What is special to the lattice; that its verdicts are true is in tolerance_check_test.cpp.
#include "check/occlusion_query.h"

#include <epoxy/egl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "base/errors.h"
#include "candidates.h"
#include "check/methods.h"
#include "gl_fixture.h"

namespace {

using namespace tolvol;
using candidates::ask;
using candidates::kIdentity;
using candidates::Points;
using glm::dvec3;

constexpr double kTolerance = 0.05;

class OcclusionQueries : public GlTest {
 protected:
  /// Squares over [0, length] x [0, 1], plane.
  static TriangleMesh strip(double length) {
    TriangleMesh mesh = shapes::grid(4);
    for (dvec3& p : mesh.vertices) p.x *= length;
    return mesh;
  }
  static std::unique_ptr<ToleranceVolume> make_volume(const TriangleMesh& reference, double precision) {
    ToleranceVolume::Options options;
    options.precision = precision;
    return std::make_unique<ToleranceVolume>(reference.vertices, reference.triangles, kIdentity, kTolerance, options);
  }
};

// Were one pixel of a lattice missing, drawn twice or taken for another's, the count would not be right.
TEST_F(OcclusionQueries, EveryPointOfEveryLatticeIsDrawnOnce) {
  const TriangleMesh reference = strip(4);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(reference, 4);
  const double h = volume->grid().spacing / volume->frame().scale();
  Points points;
  for (int n = 1; n <= 300; ++n) {
    const double length = (n - 0.5) * h;
    const dvec3 a(0.02, 0.02, 0.01), along(length, 0, 0), across(0.3 * length * std::sin(n), std::min(0.9, length), 0);
    points.insert(points.end(), {a, a + along, a + dvec3(std::abs(across.x), across.y, 0)});
  }
  const OcclusionQuery check(*volume);
  for (const Verdict v : ask(check, points)) EXPECT_EQ(v, Verdict::inside);

  const std::vector<std::uint32_t> indices = candidates::corners(points.size());
  std::vector<std::int32_t> groups(points.size() / 3);
  for (std::size_t i = 0; i < groups.size(); ++i) groups[i] = std::int32_t(i / 3);
  for (const Verdict v : check.check_groups({points, kIdentity, indices}, groups, {})) EXPECT_EQ(v, Verdict::inside);
}

TEST_F(OcclusionQueries, OnePointOutIsEnoughWhereverItIs) {
  // 0.9 of the tolerance is inside, but beyond what this precision proves; only samples about the corner see it.
  const TriangleMesh reference = strip(4);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(reference, 4);
  const OcclusionQuery check(*volume);
  const double h = volume->grid().spacing / volume->frame().scale();
  for (const int n : {1, 2, 5, 61, 62, 63, 64, 125, 200}) {
    const double length = (n - 0.5) * h;
    for (int corner = 0; corner < 3; ++corner) {
      Points points{{0.02, 0.02, 0}, {0.02 + length, 0.02, 0}, {0.02, 0.02 + std::min(length, 0.9), 0}};
      EXPECT_EQ(ask(check, points).at(0), Verdict::inside) << n;
      points[corner].z = 0.9 * kTolerance;
      EXPECT_EQ(ask(check, points).at(0), Verdict::unproved) << n << " corner " << corner;
    }
  }
}

TEST_F(OcclusionQueries, TheBoundIsTheToleranceLessWhatSamplesStandFor) {
  for (const double precision : {2.0, 4.0, 9.0}) {
    const std::unique_ptr<ToleranceVolume> volume = make_volume(strip(1), precision);
    const OcclusionQuery check(*volume);
    const double h = kTolerance / precision, near = kTolerance - h / std::sqrt(3.0), bound = near - std::sqrt(0.75) * h;
    const auto at = [&](double z) { return ask(check, {{0.1, 0.1, z}, {0.9, 0.1, z}, {0.5, 0.9, z}}).at(0); };
    EXPECT_EQ(at(bound - 1e-4 * kTolerance), Verdict::inside) << precision;
    // Between the two only samples near a node pass.
    EXPECT_EQ(at(near - 0.05 * h), Verdict::unproved) << precision;
    const glm::ivec3 middle = volume->grid().nodes / 2;
    const dvec3 node = volume->frame().to_world(volume->grid().origin + volume->grid().spacing * dvec3(middle));
    const auto above_node = [&](double z) { return ask(check, {{node.x, node.y, z}}, 1).at(0); };
    EXPECT_EQ(above_node(near - 1e-4 * kTolerance), Verdict::inside) << precision;
    EXPECT_EQ(above_node(near + 1e-4 * kTolerance), Verdict::unproved) << precision;
  }
}

TEST_F(OcclusionQueries, ATooCoarseGridIsRefusedWithThePrecisionThatWillDo) {
  const std::unique_ptr<ToleranceVolume> coarse = make_volume(strip(1), 1.4);
  try {
    const OcclusionQuery check(*coarse);
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("precision=4"), std::string::npos) << error.what();
  }
  const std::unique_ptr<ToleranceVolume> fine = make_volume(strip(1), 4);
  EXPECT_EQ(ask(OcclusionQuery(*fine), {{0.1, 0.1, 0}, {0.9, 0.1, 0}, {0.5, 0.9, 0}}).at(0), Verdict::inside);
}

TEST_F(OcclusionQueries, MoreThanABatch) {
  const TriangleMesh torus = shapes::torus(32);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(torus, 4);
  const OcclusionQuery check(*volume);
  std::vector<std::uint32_t> indices;
  std::vector<std::int32_t> groups;
  for (int turn = 0; turn < 40; ++turn) {
    for (const glm::uvec3& t : torus.triangles) {
      indices.insert(indices.end(), {t.x, t.y, t.z});
      groups.push_back(turn / 39);
    }
  }
  Points points = torus.vertices;
  points.emplace_back(1.4 + 1.5 * kTolerance, 0, 0);
  Progress progress;
  for (const Verdict v : check.check({points, kIdentity, indices}, {1, &progress})) ASSERT_EQ(v, Verdict::inside);
  EXPECT_GT(progress.fraction(), 0);
  indices.back() = std::uint32_t(points.size() - 1);
  const std::vector<Verdict> grouped = check.check_groups({points, kIdentity, indices}, groups, {});
  EXPECT_EQ(grouped.front(), Verdict::inside);
  EXPECT_EQ(grouped.back(), Verdict::unproved);
  EXPECT_EQ(grouped[39 * torus.triangles.size() - 1], Verdict::inside);
}

TEST_F(OcclusionQueries, AContextLostOnTheWayAcceptsNothingAndTheNextOneWorks) {
  const TriangleMesh reference = strip(1);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(reference, 4);
  const Points points{{0.1, 0.1, 0}, {0.9, 0.1, 0}, {0.5, 0.9, 0}};
  const auto lose = [] { eglMakeCurrent(eglGetCurrentDisplay(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); };
  for (const char* method : {"occlusion_query", "paper", "gl_certificate"}) {
    const std::unique_ptr<ToleranceCheck> check = make_check(method, *volume);
    EXPECT_EQ(ask(*check, points).at(0), Verdict::inside) << method;
    EXPECT_THROW(gl::run(lose), GlUnavailable);
    EXPECT_THROW(ask(*check, points), GlUnavailable) << method;
    EXPECT_EQ(ask(*make_check(method, *volume), points).at(0), Verdict::inside) << method;
  }
}

TEST_F(OcclusionQueries, AContextLostBetweenBatchesEndsTheCall) {
  const TriangleMesh torus = shapes::torus(64);
  const std::unique_ptr<ToleranceVolume> volume = make_volume(torus, 4);
  const OcclusionQuery check(*volume);
  std::vector<std::uint32_t> indices;
  while (indices.size() < 3'000'000) {
    for (const glm::uvec3& t : torus.triangles) indices.insert(indices.end(), {t.x, t.y, t.z});
  }
  Progress progress;
  std::thread other([&] {
    while (progress.fraction() == 0) std::this_thread::yield();
    EXPECT_THROW(
        gl::run([] { eglMakeCurrent(eglGetCurrentDisplay(), EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT); }),
        GlUnavailable);
  });
  EXPECT_THROW(check.check({torus.vertices, kIdentity, indices}, {1, &progress}), GlUnavailable);
  other.join();
  EXPECT_LT(progress.fraction(), 1);
}

}  // namespace
