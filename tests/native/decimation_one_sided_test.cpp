// SPDX-License-Identifier: GPL-3.0-or-later
// One direction alone: what it keeps, and what it gives up.
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <set>
#include <utility>

#include "decimation/decimation.h"
#include "decimation_cases.h"
#include "measure/hausdorff.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::expect_within;
using cases::run;
using glm::dvec3;
using Options = DecimationOptions;

TEST(Decimation, OneSidedKeepsForwardAndEveryComponent) {
  Options options;
  options.two_sided = false;
  int number = 0;
  for (const Case& c : cases::all()) {
    SCOPED_TRACE(testing::Message() << "case " << number++);
    const DecimationResult r = run(c, options);
    expect_within(c, r, false);
    EXPECT_FALSE(r.triangles.empty());
  }
  const Case spheres{shapes::joined(shapes::torus(10), shapes::box(3)), glm::dmat4(1), Storage::float32, 50};
  const DecimationResult r = run(spheres, options);
  std::set<bool> components;
  for (const std::uint32_t source : r.triangle_source) components.insert(source < 200);
  EXPECT_EQ(components.size(), 2u);
}

/// Boundary edges of a mesh as degenerate triangles.
TriangleMesh outline(const TriangleMesh& mesh) {
  std::map<std::pair<unsigned, unsigned>, int> count;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++count[std::minmax(t[k], t[(k + 1) % 3])];
  }
  TriangleMesh result{mesh.vertices, {}};
  for (const auto& [edge, uses] : count) {
    if (uses == 1) result.triangles.emplace_back(edge.first, edge.second, edge.second);
  }
  return result;
}

TEST(Decimation, OneSidedKeepsTheBoundary) {
  // One-sided, a plate could shrink to one triangle but for its outline.
  const Case c{shapes::stored(shapes::grid(40))};
  Options options;
  options.two_sided = false;
  const DecimationResult r = run(c, options);
  const TriangleMesh before = outline(c.mesh), after = outline({r.vertices, r.triangles});
  const double tolerance = c.tolerance();
  EXPECT_LE(hausdorff(before, after, {.bound = tolerance, .threads = 1, .narrow = false}).upper, tolerance);
  EXPECT_LE(hausdorff(after, before, {.bound = tolerance, .threads = 1, .narrow = false}).upper, tolerance);
  EXPECT_LE(r.triangles.size(), 20u);
}

TEST(Decimation, TwoSidedDecides) {
  // A spike that is thinner than the tolerance and six times as high: every lower one is within the tolerance of it,
  // and its tip is far from them.
  constexpr unsigned kSide = 50;
  Case c{shapes::stored(shapes::grid(kSide)), glm::dmat4(1), Storage::float32, 2};
  c.mesh.vertices[kSide / 2 * (kSide + 1) + kSide / 2].z = rounded_to_float32(6 * c.tolerance());
  Options one_sided;
  one_sided.two_sided = false;
  const DecimationResult without = run(c, one_sided), with = run(c);
  expect_within(c, with);
  expect_within(c, without, false);
  EXPECT_LT(without.triangles.size(), with.triangles.size());
  const TriangleMesh lost = c.world(without.vertices, without.triangles),
                     reference = c.world(c.mesh.vertices, c.mesh.triangles);
  EXPECT_GT(hausdorff(reference, lost, {std::nullopt, 1, nullptr}).lower, 2 * c.tolerance());
}

TEST(Decimation, OneSidedHoldsABoundaryThatTheReferenceDoesNotHave) {
  const TriangleMesh closed = shapes::box(8);
  TriangleMesh open{closed.vertices, {closed.triangles.begin(), closed.triangles.begin() + 128}};  // one side
  const Case c{closed};
  const auto volume = c.volume();
  Options options;
  options.two_sided = false;
  const DecimationResult r = decimate(open.vertices, open.triangles, c.space(), volume.get(), options);
  const double tolerance = c.tolerance();
  EXPECT_LE(hausdorff(open, {r.vertices, r.triangles}, {.bound = tolerance, .threads = 1, .narrow = false}).upper,
            tolerance);
  EXPECT_FALSE(r.locked.empty());
}

}  // namespace
