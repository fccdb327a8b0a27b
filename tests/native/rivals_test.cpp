// SPDX-License-Identifier: GPL-3.0-or-later
// The decimation with other methods in charge: each must decide, and keep exactly what it is about.
#include <gtest/gtest.h>

#include "baselines/checked_ring.h"
#include "baselines/vertex_samples.h"
#include "check/certificate.h"
#include "measure/hausdorff.h"
#include "operation/decimation.h"
#include "reference/errors.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

struct Decimated {
  TriangleMesh mesh;
  std::string method, renderer;
};

constexpr double kTolerance = 0.03;
const Placement kPlacement{glm::dmat4(1), Storage::float32};

Decimated by(RingCheck& rival, const TriangleMesh& mesh, const ToleranceVolume& volume,
             DecimationOptions options = {}) {
  options.rival = &rival;
  DecimationResult r = decimate(mesh.vertices, mesh.triangles, kPlacement, &volume, options);
  return {{std::move(r.vertices), std::move(r.triangles)}, r.method, r.renderer};
}

ToleranceVolume volume_of(const TriangleMesh& mesh) {
  return ToleranceVolume(mesh.vertices, mesh.triangles, kPlacement, kTolerance);
}

struct Fixed final : RingCheck {
  explicit Fixed(bool answer) : answer(answer) {}
  void begin(const TriangleMesh& mesh, double) override { triangles = mesh.triangles.size(); }
  bool accepts(std::span<const Coverage::Element> faces, std::span<const Coverage::Removed> removed) override {
    for (const Coverage::Element& face : faces) EXPECT_LT(face.id, triangles);
    for (const Coverage::Removed& face : removed) EXPECT_LT(face.id, triangles);
    return ++questions, answer;
  }
  void commit() override { ++commits; }
  std::string method() const override { return "fixed"; }

  bool answer;
  std::size_t triangles = 0, questions = 0, commits = 0;
};

TEST(Rivals, DecideAlone) {
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

TEST(Rivals, NeedAVolume) {
  const TriangleMesh mesh = shapes::torus(8);
  Fixed yes(true);
  DecimationOptions options;
  options.rival = &yes, options.target_triangles = 50;
  EXPECT_THROW(decimate(mesh.vertices, mesh.triangles, kPlacement, nullptr, options), InvalidInput);
}

TEST(CheckedRing, KeepsWhatItsCheckProves) {
  const TriangleMesh mesh = shapes::torus(60, 0.004);
  const ToleranceVolume volume = volume_of(mesh);
  const Certificate certificate(volume);
  baselines::CheckedRing ring(certificate);
  const Decimated result = by(ring, mesh, volume);
  EXPECT_LT(result.mesh.triangles.size(), 400u);
  EXPECT_LE(hausdorff(result.mesh, mesh, {kTolerance, 1, nullptr}).upper, kTolerance);
  EXPECT_EQ(result.method, "certificate");
}

double farthest_vertex(const TriangleMesh& from, const TriangleMesh& to) {
  const Hierarchy hierarchy(to);
  double farthest = 0;
  for (const dvec3& p : from.vertices) farthest = std::max(farthest, hierarchy.nearest(p).distance);
  return farthest;
}

TEST(VertexSamples, KeepVerticesAndNoMore) {
  const TriangleMesh mesh = shapes::torus(60, 0.004);
  const ToleranceVolume volume = volume_of(mesh);
  for (const auto vertices : {DecimationOptions::Vertices::optimal, DecimationOptions::Vertices::subset}) {
    baselines::VertexSamples samples(volume.frame_tolerance());
    DecimationOptions options;
    options.vertices = vertices;
    const Decimated result = by(samples, mesh, volume, options);
    EXPECT_LT(result.mesh.triangles.size(), 400u);
    const double farthest = farthest_vertex(mesh, result.mesh);
    EXPECT_LE(farthest, kTolerance * (1 + 1e-9));
    EXPECT_GT(farthest, 0.9 * kTolerance);
    EXPECT_GT(hausdorff(result.mesh, mesh, {std::nullopt, 1, nullptr}).lower, kTolerance) << "the other direction";
  }
}

}  // namespace
