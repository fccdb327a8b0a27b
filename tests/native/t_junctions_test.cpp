// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/t_junctions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "decimation_cases.h"
#include "geometry/frame.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kFloat = 0x1p-24;

std::vector<std::uint32_t> found(const std::vector<dvec3>& vertices, const std::vector<glm::uvec2>& edges) {
  Team alone(1);
  return t_junctions(vertices, edges, kFloat, alone);
}

TEST(TJunctions, AreHeldByTheVertexTheEndsAndWhatIsAtTheirPlaces) {
  const std::vector<dvec3> vertices{{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}, {0, 0, 0}, {1, 0, 0}, {5, 5, 5}, {6, 5, 5}};
  EXPECT_EQ(found(vertices, {{0, 1}, {3, 2}, {2, 4}, {5, 6}}), (std::vector<std::uint32_t>{0, 1, 2, 3, 4}));
  // The ends of one edge on those of another are no T-junction.
  EXPECT_TRUE(found(vertices, {{0, 1}, {3, 4}, {5, 6}}).empty());
  EXPECT_TRUE(found(vertices, {}).empty());
}

TEST(TJunctions, CountARoundedVertexAndNoneBesideTheEdge) {
  const dvec3 a(1000.1, 2, 3), b(1000.9, 2.7, 3.4);
  const auto rounded = [](const dvec3& p) { return rounded_to_float32(p); };
  std::size_t on = 0, beside = 0;
  for (int i = 1; i < 100; ++i) {
    const dvec3 middle = rounded(a) + i / 100.0 * (rounded(b) - rounded(a));
    on += !found({rounded(a), rounded(b), rounded(middle), dvec3(0)}, {{0, 1}, {2, 3}}).empty();
    beside +=
        !found({rounded(a), rounded(b), rounded(middle + dvec3(0, 0, 0.002)), dvec3(0)}, {{0, 1}, {2, 3}}).empty();
  }
  EXPECT_EQ(on, 99u);
  EXPECT_EQ(beside, 0u);
}

/// Two plates side by side, one of which has twice as many vertices along the edge where they meet.
TriangleMesh plates(unsigned n) {
  TriangleMesh coarse = shapes::grid(n), fine = shapes::grid(2 * n);
  for (dvec3& p : fine.vertices) p.x += 1;
  TriangleMesh both = shapes::joined(coarse, fine);
  for (dvec3& p : both.vertices) p.z = 0.02 * std::sin(5 * p.x);
  return shapes::stored(both);
}

/// The largest gap along the edge where the plates met: how far a vertex there is from the nearest point of an open
/// edge of the other plate.
double gap(const DecimationResult& r) {
  std::vector<glm::uvec2> open[2];
  for (const glm::uvec3& t : r.triangles) {
    const double x = (r.vertices[t.x].x + r.vertices[t.y].x + r.vertices[t.z].x) / 3;
    for (int k = 0; k < 3; ++k) open[x > 1].emplace_back(t[k], t[(k + 1) % 3]);
  }
  double largest = 0;
  for (const int side : {0, 1}) {
    for (const glm::uvec2& edge : open[side]) {
      const dvec3& p = r.vertices[edge.x];
      if (std::abs(p.x - 1) > 0.01) continue;
      double nearest = 1;
      for (const glm::uvec2& other : open[1 - side]) {
        const dvec3 &a = r.vertices[other.x], &b = r.vertices[other.y];
        const double t = std::clamp(glm::dot(p - a, b - a) / glm::dot(b - a, b - a), 0.0, 1.0);
        nearest = std::min(nearest, glm::length(p - a - t * (b - a)));
      }
      largest = std::max(largest, nearest);
    }
  }
  return largest;
}

TEST(TJunctions, DoNotOpenInADecimation) {
  for (const auto effort : {DecimationOptions::Effort::fast, DecimationOptions::Effort::thorough}) {
    for (const bool two_sided : {true, false}) {
      const unsigned n = across(20);
      const cases::Case c{plates(n)};
      DecimationOptions options;
      options.effort = effort, options.two_sided = two_sided;
      const DecimationResult r = cases::run(c, options);
      EXPECT_LT(gap(r), 1e-6);
      EXPECT_LT(r.triangles.size(), c.mesh.triangles.size() / 4);
      ASSERT_TRUE(r.locked.contains("T-junction"));
      EXPECT_EQ(r.locked.at("T-junction"), (n + 1) + (2 * n + 1)) << "the vertices of both borders";
      cases::expect_within(c, r, two_sided);
    }
  }
}

}  // namespace
