// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes large enough to be cut into regions.
#include "decimation/collapse_rounds.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/errors.h"
#include "decimation_cases.h"
#include "shapes.h"
#include "topology/wedges.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::Options;
using glm::dvec3;

constexpr unsigned kSquares = 94;

TriangleMesh waves() {
  TriangleMesh mesh = shapes::grid(kSquares);
  for (dvec3& p : mesh.vertices) p.z = 0.03 * std::sin(9 * p.x) * std::cos(7 * p.y);
  return shapes::stored(mesh);
}

/// A second sheet through the middle of the first: an edge of four faces along the whole of it.
TriangleMesh crossing() {
  TriangleMesh mesh = waves();
  for (unsigned i = 0; i < kSquares; ++i) {
    const unsigned a = i * (kSquares + 1) + kSquares / 2, b = a + kSquares + 1, n = unsigned(mesh.vertices.size());
    mesh.vertices.push_back(mesh.vertices[a] + dvec3(0, 0, 0.2));
    mesh.vertices.push_back(mesh.vertices[b] + dvec3(0, 0, 0.2));
    mesh.triangles.emplace_back(a, b, n), mesh.triangles.emplace_back(b, n + 1, n);
  }
  return shapes::stored(mesh);
}

std::vector<Case> large() {
  return {{shapes::torus(kSquares, 0.001)}, {waves()}, {crossing()}, {shapes::soup(shapes::torus(kSquares))}};
}

TEST(CollapseRounds, KeepTheTolerance) {
  for (const Case& c : large()) cases::expect_within(c, cases::run(c));
}

TEST(CollapseRounds, LeaveAsManyTrianglesAsOneLoop) {
  const Case c{shapes::torus(kSquares, 0.001)};
  Options options;
  const DecimationResult rounds = cases::run(c, options);
  options.target_triangles = 1;  // what a target asks for is the order of the whole
  const DecimationResult whole = cases::run(c, options);
  EXPECT_NE(rounds.vertices, whole.vertices) << "there were rounds";
  EXPECT_NEAR(double(rounds.triangles.size()), double(whole.triangles.size()), 0.04 * double(whole.triangles.size()));
}

TEST(CollapseRounds, ThreadsDoNotChangeABit) {
  bool seams = true;
  for (const Case& c : large()) {
    Options options;
    std::vector<std::uint32_t> wedges;
    if (seams) {  // across the mesh, in two directions
      std::vector<float> values;
      for (const glm::uvec3& t : c.mesh.triangles) {
        const dvec3 centre = (c.mesh.vertices[t.x] + c.mesh.vertices[t.y] + c.mesh.vertices[t.z]) / 3.0;
        for (int k = 0; k < 3; ++k) values.push_back(float((centre.x > 0.3) + 2 * (centre.y > 0.4)));
      }
      wedges = wedge_labels(c.mesh.triangles, values, 1);
      options.wedges = wedges;
    }
    options.two_sided = seams;  // one-sided, boundaries have bounds of their own
    cases::expect_same_bits(c, options, {4});
    seams = !seams;
  }
}

TEST(CollapseRounds, StopWhenCancelled) {
  const Case c{waves()};
  for (const unsigned threads : {1u, 4u}) {
    Progress progress;
    progress.cancel();
    Options options;
    options.progress = &progress, options.threads = threads;
    EXPECT_THROW(cases::run(c, options), Cancelled);
  }
}

}  // namespace
