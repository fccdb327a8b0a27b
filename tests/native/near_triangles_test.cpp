// SPDX-License-Identifier: GPL-3.0-or-later
// Judged by the hierarchy, part by part; costs are held by counting its searches.
#include "check/near_triangles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "base/parallel.h"
#include "check/facing.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kRadius = 2e-4;

/// Triangles as large as the cube that they fill, most of which run through many others.
TriangleMesh tangle(unsigned count) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> u(-1, 1);
  TriangleMesh mesh;
  for (unsigned i = 0; i < 3 * count; ++i) {
    const double x = u(engine), y = u(engine), z = u(engine);
    mesh.vertices.emplace_back(x, y, z);
    if (i % 3 == 2) mesh.triangles.emplace_back(i - 2, i - 1, i);
  }
  return mesh;
}

struct Work {
  std::size_t parts = 0, searches = 0;
};

/// Quarters a face of the reference, moved a little, towards one of its corners, and compares every answer, among the
/// triangles that face to the side of `normal` if there is one.
Work follow(const TriangleMesh& mesh, std::uint32_t face, int levels, std::optional<dvec3> normal = {}) {
  const Hierarchy hierarchy(mesh);
  Team alone(1);
  FacingRule rule(mesh, 1e-15, 1e-15, std::numbers::pi / 2, alone);
  rule.bound_normals(hierarchy, alone);
  std::optional<Facing> facing;
  if (normal) facing.emplace(rule, *normal, rule.angle);
  const Witnesses witnesses(mesh);
  const glm::uvec3 t = mesh.triangles[face];
  const dvec3 step(0.3 * kRadius, -0.2 * kRadius, 0.4 * kRadius);
  const dvec3 end = mesh.vertices[t.x] + step;
  std::vector<Part> queue{{{end, mesh.vertices[t.y] + step, mesh.vertices[t.z] - step}}};
  NearTriangles around;
  around.begin(witnesses, hierarchy, kRadius, facing ? &*facing : nullptr);
  Work work;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    Part part = queue[next];
    const dvec3 centre = (part.corners[0] + part.corners[1] + part.corners[2]) * (1.0 / 3);
    for (const double radius : {kRadius, kRadius / 2}) {
      const auto is_due = [&](std::uint32_t triangle) { return !facing || facing->admits(triangle); };
      EXPECT_EQ(around.nearest(part, centre, radius, Hierarchy::kNone),
                hierarchy.nearest_if(centre, is_due, radius).triangle);
    }
    ++work.parts;
    if (part.cuts == static_cast<std::uint32_t>(levels)) continue;
    std::vector<Part> halves;
    split(part, halves);
    for (const Part& half : halves) {
      const double size = 3 * std::sqrt(longest_squared(half));
      if (glm::length(half.corners[0] - end) <= size || glm::length(half.corners[1] - end) <= size ||
          glm::length(half.corners[2] - end) <= size) {
        queue.push_back(half);
      }
    }
  }
  work.searches = around.searches();
  return work;
}

TEST(NearTriangles, AnswersAreThoseOfTheHierarchy) {
  TriangleMesh twins = shapes::torus(20);
  twins.triangles.insert(twins.triangles.end(), twins.triangles.begin(), twins.triangles.begin() + 300);
  for (dvec3& p : twins.vertices) p *= 0.7;
  const TriangleMesh flat = shapes::grid(8);  // many parts are as near to one triangle as to the next
  for (const TriangleMesh& mesh : {tangle(300), twins, flat}) {
    for (const std::uint32_t face : {0u, 7u, 99u}) {
      EXPECT_GT(follow(mesh, face, 9).parts, 100u);
      for (const dvec3& normal : {dvec3(0, 0, 1), dvec3(0, 0, -1), dvec3(1, 0, 0)}) follow(mesh, face, 9, normal);
    }
  }
}

TEST(NearTriangles, FewPartsAmongOverlappingTrianglesAskTheHierarchy) {
  const TriangleMesh mesh = tangle(3000);
  Work all;
  for (std::uint32_t face = 0; face < 10; ++face) {
    const Work work = follow(mesh, face, 10);
    all.parts += work.parts, all.searches += work.searches;
  }
  EXPECT_GT(all.parts, 1000u);
  // Each part is asked about twice: a quarter of what it would be without lists.
  EXPECT_LT(all.searches, all.parts / 2);
}

TEST(NearTriangles, AmongSmallTrianglesASearchCostsLessThanAList) {
  const Work work = follow(shapes::torus(60), 7, 9);
  EXPECT_GT(work.parts, 100u);
  EXPECT_EQ(work.searches, 2 * work.parts) << "each part is asked about twice";
}

TEST(NearTriangles, NothingNearIsNoTriangle) {
  const TriangleMesh mesh = tangle(50);
  const Hierarchy hierarchy(mesh);
  const Witnesses witnesses(mesh);
  NearTriangles around;
  around.begin(witnesses, hierarchy, kRadius);
  for (int i = 0; i < 30; ++i) {
    Part part{{dvec3(3, 3, 3), dvec3(3.1, 3, 3), dvec3(3, 3.1, 3)}};
    EXPECT_EQ(around.nearest(part, dvec3(3.03, 3.03, 3), kRadius, Hierarchy::kNone), Hierarchy::kNone);
  }
  EXPECT_LT(around.searches(), 10u);
}

}  // namespace
