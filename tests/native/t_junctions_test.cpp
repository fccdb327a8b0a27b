// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/t_junctions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "decimation_cases.h"
#include "geometry/frame.h"
#include "geometry/hierarchy.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kFloat = 0x1p-24;

std::vector<std::uint32_t> found(const TriangleMesh& mesh, const std::vector<glm::uvec2>& open) {
  Team alone(1);
  return t_junctions(mesh, open, kFloat, alone);
}

using Indices = std::vector<std::uint32_t>;

/// Triangles above the x axis, from 0 to 1 and from 2 to 3, and below it from 0 to 0.5 and from 0.5 to 1.
const TriangleMesh kAlongALine{
    {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}, {0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {0, 1, 0}, {0, -1, 0}},
    {{0, 1, 7}, {3, 8, 2}, {2, 8, 4}, {5, 6, 7}}};

TEST(TJunctions, AreHeldByTheVertexTheEndsAndWhatIsAtTheirPlaces) {
  EXPECT_EQ(found(kAlongALine, {{0, 1}, {3, 2}, {2, 4}, {5, 6}}), (Indices{0, 1, 2, 3, 4}));
  // The ends of one edge on those of another are no T-junction.
  EXPECT_TRUE(found(kAlongALine, {{0, 1}, {3, 4}, {5, 6}}).empty());
  EXPECT_TRUE(found(kAlongALine, {}).empty());
}

TEST(TJunctions, AreNotWhereCornersDifferByRounding) {
  for (const dvec3& rounded : {dvec3(0x1p-26, 0x1p-26, 0), dvec3(1, -0x1p-26, 0x1p-26), dvec3(1 - 0x1p-24, 0, 0)}) {
    TriangleMesh mesh = kAlongALine;
    mesh.vertices[2] = rounded;
    mesh.vertices.emplace_back(1, -1, 0);
    mesh.triangles = {{0, 1, 7}, {2, 8, 9}};
    EXPECT_EQ(found(mesh, {{0, 1}, {1, 7}, {7, 0}, {2, 8}, {8, 9}, {9, 2}}), Indices{}) << rounded.x;
  }
}

TEST(TJunctions, DoNotComeFromOutliers) {
  TriangleMesh mesh = shapes::joined(shapes::grid(8), shapes::grid(8));
  for (std::size_t v = mesh.vertices.size() / 2; v < mesh.vertices.size(); ++v) mesh.vertices[v].z = 0.5;
  std::vector<glm::uvec2> open;
  for (std::uint32_t v = 0; v < 8; ++v) open.emplace_back(v, v + 1);
  EXPECT_EQ(found(mesh, open), Indices{});
  mesh.vertices.front() = dvec3(1e19);
  EXPECT_EQ(found(mesh, open), Indices{});
}

TEST(TJunctions, AreFoundAtAnyScale) {
  for (const double scale : {1e-300, 1e-160, 1e160, 1e300}) {
    TriangleMesh mesh = kAlongALine;
    for (dvec3& p : mesh.vertices) p *= scale;
    EXPECT_EQ(found(mesh, {{0, 1}, {3, 2}, {2, 4}, {5, 6}}), (Indices{0, 1, 2, 3, 4})) << scale;
  }
}

TEST(TJunctions, CountARoundedVertexAndNoneBesideTheEdge) {
  const dvec3 a(1000.1, 2, 3), b(1000.9, 2.7, 3.4);
  const auto rounded = [](const dvec3& p) { return rounded_to_float32(p); };
  const auto is_found = [&](const dvec3& p) {
    const TriangleMesh mesh{{rounded(a), rounded(b), rounded(p), dvec3(0), dvec3(1000, 0, 0), dvec3(1000, 10, 0)},
                            {{0, 1, 4}, {2, 3, 5}}};
    return !found(mesh, {{0, 1}, {2, 3}}).empty();
  };
  std::size_t on = 0, beside = 0;
  for (int i = 1; i < 100; ++i) {
    const dvec3 middle = rounded(a) + i / 100.0 * (rounded(b) - rounded(a));
    on += is_found(middle), beside += is_found(middle + dvec3(0, 0, 0.002));
  }
  EXPECT_EQ(on, 99u);
  EXPECT_EQ(beside, 0u);
}

TEST(TJunctions, AreAlsoOnTheInsideOfFacesAndOnEdgesThatAreNotOpen) {
  // A square of two triangles; above it a triangle that stands on the diagonal, and one that stands on one half.
  TriangleMesh mesh{{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const auto standing_on = [&](const dvec3& a, const dvec3& b) {
    TriangleMesh both = mesh;
    both.vertices.insert(both.vertices.end(), {a, b, a + dvec3(0, 0, 1)});
    both.triangles.emplace_back(4, 5, 6);
    return found(both, {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 4}});
  };
  EXPECT_EQ(standing_on({1, 1, 0}, {3, 3, 0}), (Indices{0, 2, 4, 5}));
  EXPECT_EQ(standing_on({3, 1, 0}, {3.5, 2, 0}), (Indices{0, 1, 2, 4, 5}));
  EXPECT_EQ(standing_on({3, 1, 1e-3}, {3.5, 2, 1e-3}), Indices{});
}

TEST(TJunctions, AreWhereAVertexInsideOfASheetLiesOnAnOpenEdge) {
  // A tent of four triangles around vertex 0, and a triangle that stands on its tip with the middle of an edge.
  const TriangleMesh mesh{{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {-1, 0, 1}, {1, 0, 1}, {0, 0, 2}},
                          {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}, {5, 6, 7}}};
  const std::vector<glm::uvec2> open{{1, 2}, {2, 3}, {3, 4}, {4, 1}, {5, 6}, {6, 7}, {7, 5}};
  EXPECT_EQ(found(mesh, open), (Indices{0, 5, 6}));
  TriangleMesh flat = mesh;  // The triangle lies upon the tent's four, all in one plane.
  flat.vertices[0].z = flat.vertices[5].z = flat.vertices[6].z = 0;
  flat.vertices[5].x = -0.5, flat.vertices[6].x = 0.5, flat.vertices[7] = {0, 0.25, 0};
  EXPECT_EQ(found(flat, open), Indices{});
}

TEST(TJunctions, AreWhereAFootLiesAcrossEdges) {
  // A strip of four squares; on it stands a triangle, whose foot goes over two squares between those with its ends.
  TriangleMesh mesh;
  std::vector<glm::uvec2> open;
  for (std::uint32_t i = 0; i <= 4; ++i) {
    mesh.vertices.insert(mesh.vertices.end(), {dvec3(2 * i, 0, 0), dvec3(2 * i, 2, 0)});
    if (i == 4) break;
    mesh.triangles.emplace_back(2 * i, 2 * i + 2, 2 * i + 3), mesh.triangles.emplace_back(2 * i, 2 * i + 3, 2 * i + 1);
    open.insert(open.end(), {{2 * i, 2 * i + 2}, {2 * i + 1, 2 * i + 3}});
  }
  mesh.vertices.insert(mesh.vertices.end(), {dvec3(1.5, 0.5, 0), dvec3(6.5, 1.5, 0), dvec3(4, 1, 3)});
  mesh.triangles.emplace_back(10, 11, 12);
  open.insert(open.end(), {{0, 1}, {8, 9}, {10, 11}, {11, 12}, {12, 10}});
  EXPECT_EQ(found(mesh, open), (Indices{0, 2, 3, 4, 5, 6, 7, 9, 10, 11}));
  mesh.vertices[11].z = 0.5;  // the foot rises over the strip
  EXPECT_EQ(found(mesh, open), (Indices{0, 2, 3, 10}));
  mesh.vertices[11].z = 0, mesh.vertices[12].z = 0;  // it lies in the plane of the strip
  EXPECT_EQ(found(mesh, open), Indices{});
}

TEST(TJunctions, AreNotWhereASheetLiesUponAnotherInItsPlane) {
  // Two squares at a right angle, and a triangle upon one of them that reaches the edge between them.
  const TriangleMesh mesh{
      {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 0, 4}, {4, 0, 4}, {1, 0, 0}, {3, 0, 0}, {3, 1, 0}},
      {{0, 1, 2}, {0, 2, 3}, {1, 0, 4}, {1, 4, 5}, {6, 7, 8}}};
  const std::vector<glm::uvec2> open{{1, 2}, {2, 3}, {3, 0}, {0, 4}, {4, 5}, {5, 1}, {6, 7}, {7, 8}, {8, 6}};
  EXPECT_EQ(found(mesh, open), Indices{});
  TriangleMesh risen = mesh;
  risen.vertices[8].z = 1;
  EXPECT_EQ(found(risen, open), (Indices{0, 1, 6, 7}));
}

TEST(TJunctions, AreNotWhereATriangleThatIsASegmentFillsThePlace) {
  // Vertex 2 is on the edge from 0 to 1 of the triangle below, to which a segment through all three joins it.
  const TriangleMesh mesh{{{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, 1, 0}},
                          {{1, 0, 3}, {0, 1, 2}, {0, 2, 4}, {2, 1, 4}}};
  EXPECT_TRUE(found(mesh, {{0, 3}, {3, 1}, {2, 1}, {1, 4}, {4, 0}}).empty());
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
      EXPECT_FALSE(r.locked.contains("T-junction"));
      cases::expect_within(c, r, two_sided);
    }
  }
}

/// A plate in the plane z = 0 on which a wall of squares stands, with which it shares no vertex.
TriangleMesh plate_with_wall(unsigned n) {
  const TriangleMesh wall = shapes::squares(n / 2, [](const dvec3& p) { return dvec3(0.21 + 0.57 * p.x, 0.43, p.y); });
  return shapes::stored(shapes::joined(shapes::grid(n), wall));
}

/// A soup of triangles around the origin, and all their edges.
std::size_t polls_of_soup(std::uint32_t count, bool open_at_the_rim_alone) {
  TriangleMesh mesh;
  std::vector<glm::uvec2> open;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto on_rim = [&](std::uint32_t k) {
      const double angle = 2 * std::numbers::pi * (k % count) / count;
      return dvec3(std::cos(angle), std::sin(angle), 0);
    };
    mesh.vertices.insert(mesh.vertices.end(), {dvec3(0), on_rim(i), on_rim(i + 1)});
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    open.emplace_back(3 * i + 1, 3 * i + 2);
    if (!open_at_the_rim_alone) open.insert(open.end(), {{3 * i, 3 * i + 1}, {3 * i + 2, 3 * i}});
  }
  return polls_of([&] { EXPECT_EQ(found(mesh, open), Indices{}); });
}

TEST(TJunctions, LookOnceAtWhatIsAroundManyVerticesAtOnePlace) {
  for (const bool at_the_rim_alone : {false, true}) {
    const std::size_t few = polls_of_soup(500, at_the_rim_alone), many = polls_of_soup(4000, at_the_rim_alone);
    EXPECT_LT(many, 12 * few + 100);
  }
}

TEST(TJunctions, NeedlesThatEndNearEachOtherAreDividedTogether) {
  // Each needle has an end of its own near the middle. All ends are near all needles, and on none but their own.
  constexpr std::uint32_t count = 16'000;
  TriangleMesh mesh;
  std::vector<glm::uvec2> open;
  shapes::Random random(7);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto on_rim = [&](double k) {
      const double angle = 2 * std::numbers::pi * k / count;
      return dvec3(std::cos(angle), std::sin(angle), 0) + 0.001 * random.point();
    };
    mesh.vertices.insert(mesh.vertices.end(), {0.001 * random.point(), on_rim(i), on_rim(i + 1)});
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    open.insert(open.end(), {{3 * i, 3 * i + 1}, {3 * i + 1, 3 * i + 2}, {3 * i + 2, 3 * i}});
  }
  // A vertex on the inside of a needle in the middle of the crowd, with a face of its own.
  const dvec3 on = 0.9998 * mesh.vertices[0] + 0.0001 * mesh.vertices[1] + 0.0001 * mesh.vertices[2];
  mesh.vertices.insert(mesh.vertices.end(), {on, on + dvec3(0, 0, 1), on + dvec3(1, 0, 1)});
  mesh.triangles.emplace_back(3 * count, 3 * count + 1, 3 * count + 2);
  open.emplace_back(3 * count, 3 * count + 1);
  Team alone(1);
  const std::size_t polls = polls_of([&] {
    EXPECT_EQ(t_junctions(mesh, open, 0x1p-53, alone), (Indices{0, 1, 2, 3 * count}));
  });
  EXPECT_LT(polls, 20'000) << "a search for each end looks at most of the needles, and takes 42,186";
}

TEST(TJunctions, ALongFootStaysOnItsPlate) {
  // The plate is bent on both sides of the foot, which goes over many of its squares.
  const unsigned n = 24;
  TriangleMesh plate = shapes::squares(n, [&](const dvec3& p) {
    return dvec3(p.x, p.y, 0.3 * std::max(0.0, std::abs(p.x - 0.43) - 1.0 / n) * std::cos(3 * p.y));
  });
  const std::size_t below = plate.triangles.size();
  const TriangleMesh wall{{{0.43, 0.11, 0}, {0.43, 0.93, 0}, {0.43, 0.5, 0.5}}, {{0, 1, 2}}};
  const cases::Case c{shapes::stored(shapes::joined(plate, wall)), glm::dmat4(1), Storage::float32, 0.3};
  for (const auto effort : {DecimationOptions::Effort::fast, DecimationOptions::Effort::thorough}) {
    DecimationOptions options;
    options.effort = effort;
    const DecimationResult r = cases::run(c, options);
    EXPECT_LT(r.triangles.size(), below / 4);
    TriangleMesh of_plate{r.vertices, {}};
    for (std::size_t t = 0; t < r.triangles.size(); ++t) {
      if (r.triangle_source[t] < below) of_plate.triangles.push_back(r.triangles[t]);
    }
    const Hierarchy hierarchy(of_plate);
    for (int i = 0; i <= 100; ++i) {
      const dvec3 foot = rounded_to_float32(dvec3(0.43, 0.11 + 0.0082 * i, 0));
      EXPECT_LT(hierarchy.nearest(foot).distance, 1e-6);
    }
    cases::expect_within(c, r, true);
  }
}

TEST(TJunctions, AWallStaysOnItsPlate) {
  for (const auto effort : {DecimationOptions::Effort::fast, DecimationOptions::Effort::thorough}) {
    const cases::Case c{plate_with_wall(across(20))};
    DecimationOptions options;
    options.effort = effort;
    const DecimationResult r = cases::run(c, options);
    std::size_t standing = 0;
    for (const glm::uvec3& t : r.triangles) {
      for (int k = 0; k < 3; ++k) {
        const dvec3 &p = r.vertices[t[k]], &q = r.vertices[t[(k + 1) % 3]];
        if (p.y != q.y || std::abs(p.y - 0.43) > 1e-6 || std::max(p.z, q.z) > 0.01) continue;
        EXPECT_EQ(std::max(p.z, q.z), 0);
        ++standing;
      }
    }
    EXPECT_GE(standing, across(20) / 2u) << "the open edges of the wall that lie on the plate";
    EXPECT_LT(r.triangles.size(), c.mesh.triangles.size());
    cases::expect_within(c, r, true);
  }
}

}  // namespace
