// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/hierarchy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>

#include "many.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Triangles of all sizes: some as large as the whole, most small, a part degenerate.
TriangleMesh soup(unsigned seed, unsigned triangles, double scale = 1, dvec3 offset = dvec3(0)) {
  shapes::Random random(seed);
  TriangleMesh mesh;
  for (unsigned i = 0; i < triangles; ++i) {
    const double size = std::pow(10.0, -double(random.below(4)));
    const dvec3 centre = random.point();
    for (int k = 0; k < 3; ++k) {
      const bool repeat = k > 0 && random.below(10) == 0;
      mesh.vertices.push_back(repeat ? mesh.vertices.back() : offset + scale * (centre + size * random.point()));
    }
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

ClosestPoint closest(const TriangleMesh& mesh, std::uint32_t i, const dvec3& p) {
  const glm::uvec3& t = mesh.triangles[i];
  return closest_point(p, mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]);
}

template <class Accept>
Hierarchy::Nearest brute(const TriangleMesh& mesh, const dvec3& p, double radius, Accept&& accept) {
  Hierarchy::Nearest best;
  double squared = kInfinity;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    if (!accept(i)) continue;
    const ClosestPoint q = closest(mesh, i, p);
    if (q.distance_squared < squared && std::sqrt(q.distance_squared) <= radius) {
      squared = q.distance_squared;
      best = {i, q.point, q.weights, std::sqrt(squared)};
    }
  }
  return best;
}

const auto all = [](std::uint32_t) { return true; };

TEST(Hierarchy, AgreesWithBruteForceBitForBit) {
  const TriangleMesh mesh = soup(1, 1500);
  const Hierarchy hierarchy(mesh);
  ASSERT_EQ(hierarchy.size(), 1500u);
  shapes::Random random(2);
  for (int i = 0; i < 2000; ++i) {
    // from the surface, from close by, from the outside, from afar, from so far that the search is made in doubles
    const double off = std::array{0.0, 1e-3, 1.0, 30.0, 1e5}[i % 5];
    const dvec3 p = mesh.vertices[random.below(4500)] + off * random.point();
    const Hierarchy::Nearest expected = brute(mesh, p, kInfinity, all);
    const Hierarchy::Nearest found = hierarchy.nearest(p);
    ASSERT_EQ(found.triangle, expected.triangle) << i;
    ASSERT_EQ(found.distance, expected.distance);
    ASSERT_EQ(found.point, expected.point);
    ASSERT_EQ(found.weights, expected.weights);
    const Hierarchy::Nearest hinted = hierarchy.nearest(p, kInfinity, random.below(1500));
    ASSERT_EQ(hinted.triangle, expected.triangle);
    ASSERT_EQ(hinted.distance, expected.distance);
  }
}

/// Needles from the middle to a rim whose points lie at two heights, or between two lines; turned out of the axes.
TriangleMesh needles(unsigned count, bool around_a_point) {
  const dvec3 x = glm::normalize(dvec3(0.6, 0.5, 0.4)), y = glm::normalize(glm::cross(x, {0.1, 0.2, 0.9}));
  const dvec3 z = glm::cross(x, y);
  TriangleMesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const double part = double(i) / count, angle = 2 * std::numbers::pi * part;
    mesh.vertices.push_back(around_a_point ? std::cos(angle) * x + std::sin(angle) * y + 0.1 * (i % 2) * z : part * x);
  }
  mesh.vertices.push_back(around_a_point ? dvec3(0) : y);
  for (unsigned i = 0; i < count; ++i) mesh.triangles.push_back({count, i, (i + 1) % count});
  return mesh;
}

using Link = std::array<std::uint32_t, 3>;

/// What is below each node: (the node, a triangle, 0) or (the node, the node below, 1).
std::vector<Link> links(const Hierarchy& tree) {
  std::vector<Link> found;
  for (std::uint32_t node = 0; node < tree.node_count(); ++node) {
    tree.for_each_child(
        node,
        [&](std::uint32_t triangle) {
          found.push_back({node, triangle, 0});
        },
        [&](std::uint32_t below) {
          EXPECT_GT(below, node);
          found.push_back({node, below, 1});
        });
  }
  return found;
}

// The mesh has equal triangles, slices and oriented boxes. It is large enough for several threads under the sanitizers,
// too.
TEST(Hierarchy, ThreadsMakeTheSameTree) {
  const TriangleMesh equal = soup(4, 1000);
  const TriangleMesh mesh =
      shapes::joined(shapes::joined(soup(3, 45'000), equal), shapes::joined(equal, needles(15'000, true)));
  const Hierarchy alone(mesh);
  for (const unsigned threads : {2u, 3u}) {
    const Hierarchy shared(mesh, threads);
    ASSERT_EQ(links(shared), links(alone));
    EXPECT_EQ(shared.has_mostly_needles(), alone.has_mostly_needles());
    shapes::Random random(5);
    for (int i = 0; i < 500; ++i) {
      // The number of nodes depends on the boxes, and on where the triangle that is tried first has its place.
      const dvec3 p = 1.5 * random.point();
      const auto hint = std::uint32_t(random.below(unsigned(mesh.triangles.size())));
      ASSERT_EQ(alone.nearest(p, kInfinity, hint).nodes, shared.nearest(p, kInfinity, hint).nodes);
      ASSERT_EQ(alone.nearest(p).triangle, shared.nearest(p).triangle);
    }
  }
}

TEST(Hierarchy, AgreesWithBruteForceAmongNeedles) {
  for (const bool around_a_point : {true, false}) {
    const TriangleMesh mesh = needles(700, around_a_point);
    const Hierarchy hierarchy(mesh);
    shapes::Random random(20);
    for (int i = 0; i < 1000; ++i) {
      const double off = std::array{0.0, 1e-6, 1e-2, 1.0, 1e5}[i % 5];
      const dvec3 p = mesh.vertices[random.below(701)] * (i % 7 / 6.0) + off * random.point();
      const Hierarchy::Nearest expected = brute(mesh, p, kInfinity, all), found = hierarchy.nearest(p);
      ASSERT_EQ(found.triangle, expected.triangle) << i;
      ASSERT_EQ(found.distance, expected.distance);
      ASSERT_EQ(hierarchy.nearest(p, expected.distance).triangle, expected.triangle);
    }
  }
}

// Boxes along the axes around needles in all directions overlap so much that a search looks at a third of them.
TEST(Hierarchy, LooksAtFewOfManyNeedles) {
  for (const bool around_a_point : {true, false}) {
    const TriangleMesh mesh = needles(20000, around_a_point);
    const Hierarchy hierarchy(mesh);
    shapes::Random random(21);
    std::size_t looked_at = 0;
    for (int i = 0; i < 500; ++i) {
      const glm::uvec3& t = mesh.triangles[random.below(20000)];
      const dvec3 p = 0.3 * mesh.vertices[t.x] + 0.4 * mesh.vertices[t.y] + 0.3 * mesh.vertices[t.z];
      hierarchy.for_each_within(p, 1e-5, [&](std::uint32_t) { ++looked_at; });
      hierarchy.nearest_if(p, [&](std::uint32_t) { return ++looked_at > 0; });
    }
    EXPECT_LT(looked_at, 500u * 30) << around_a_point;
  }
}

// Near the hub of a fan each needle is far narrower than at the rim, and so are the slices that a search looks at.
TEST(Hierarchy, LooksAtFewNearTheHubOfAFan) {
  const unsigned count = many(20000);
  const TriangleMesh mesh = needles(count, true);
  const Hierarchy hierarchy(mesh);
  shapes::Random random(22);
  for (const double from_hub : {0.1, 0.01, 0.002}) {
    std::size_t looked_at = 0;
    for (int i = 0; i < 100; ++i) {
      const std::uint32_t below = random.below(count);
      const glm::uvec3& t = mesh.triangles[below];
      const dvec3 p = from_hub * 0.5 * (mesh.vertices[t.y] + mesh.vertices[t.z]) + 1e-7 * random.point();
      const Hierarchy::Nearest found = hierarchy.nearest_if(p, [&](std::uint32_t) { return ++looked_at > 0; });
      ASSERT_EQ(found.distance, brute(mesh, p, kInfinity, all).distance);
      looked_at += found.nodes;
      std::vector<std::uint32_t> within;
      hierarchy.for_each_within(p, 1e-6, [&](std::uint32_t triangle) { within.push_back(triangle); });
      looked_at += within.size();
      std::ranges::sort(within);
      ASSERT_EQ(std::ranges::adjacent_find(within), within.end()) << "once each";
      ASSERT_TRUE(std::ranges::binary_search(within, below));
    }
    EXPECT_LT(looked_at, 100u * 200) << from_hub;
  }
}

// Where the hub is the nearest point, all needles around it are as near.
TEST(Hierarchy, LooksAtFewWhereAHubIsNearest) {
  const unsigned count = many(20000);
  shapes::Random random(24);
  TriangleMesh mesh;  // a sector of a fan, whose hub has the lowest x
  for (unsigned i = 0; i <= count; ++i) {
    const double angle = double(i) / count - 0.5;
    mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), 0.01 * random.share());
    if (i > 0) mesh.triangles.push_back({i, i - 1, count + 1});
  }
  mesh.vertices.emplace_back(0);
  std::ranges::shuffle(mesh.triangles, std::mt19937(25));
  const Hierarchy hierarchy(mesh);
  std::size_t looked_at = 0;
  for (int i = 0; i < 30; ++i) {
    const dvec3 p = (i % 3 == 0 ? 1e-6 : 1.0) * dvec3(-1, random.share() - 0.5, random.share() - 0.5);
    const Hierarchy::Nearest found = hierarchy.nearest_if(p, [&](std::uint32_t) { return ++looked_at > 0; });
    looked_at += found.nodes;
    ASSERT_EQ(found.point, dvec3(0)) << i;
    ASSERT_EQ(found.triangle, 0u);
    ASSERT_EQ(found.weights, brute(mesh, p, kInfinity, all).weights);
    // One that is not accepted says nothing about the others.
    for (const std::uint32_t step : {2u, 50u}) {
      const auto some = [&](std::uint32_t triangle) { return triangle % step == 1; };
      ASSERT_EQ(hierarchy.nearest_if(p, some).triangle, 1u);
      const auto late = [&](std::uint32_t triangle) { return triangle > count / step; };
      ASSERT_EQ(hierarchy.nearest_if(p, late).triangle, count / step + 1);
    }
  }
  EXPECT_LT(looked_at, 30u * 100);
}

// One of the edges at the hub may be much shorter than the other or have no length, or both may have any direction.
TEST(Hierarchy, LooksAtFewNearTheHubOfUnequalEdges) {
  const unsigned count = many(20000);
  shapes::Random random(23);
  for (const double shorter : {0.05, 0.0, 1.0}) {
    TriangleMesh mesh;
    for (unsigned i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * i / count;
      const dvec3 rim(std::cos(angle), std::sin(angle), 0);
      mesh.vertices.push_back(i % 2 == 0 ? rim + 0.01 * random.point() : shorter * (rim + 0.2 * random.point()));
      mesh.triangles.push_back({i, (i + 1) % count, count});
    }
    mesh.vertices.emplace_back(0);
    const Hierarchy hierarchy(mesh);
    for (const double from_hub : {0.04, 0.01, 0.003}) {
      std::size_t nodes = 0;
      for (int i = 0; i < 30; ++i) {
        const double angle = random.share() * 2 * std::numbers::pi;
        const dvec3 p = from_hub * dvec3(std::cos(angle), std::sin(angle), i % 2 * 0.1);
        const Hierarchy::Nearest expected = brute(mesh, p, kInfinity, all), found = hierarchy.nearest(p);
        ASSERT_EQ(found.distance, expected.distance);
        ASSERT_EQ(found.triangle, expected.triangle);
        nodes += found.nodes;
        std::vector<std::uint32_t> within;
        const double radius = 2 * found.distance;
        hierarchy.for_each_within(p, radius, [&](std::uint32_t triangle) { within.push_back(triangle); });
        std::ranges::sort(within);
        ASSERT_EQ(std::ranges::adjacent_find(within), within.end()) << "once each";
        const auto is_missed = [&](std::uint32_t t) { return !std::ranges::binary_search(within, t); };
        ASSERT_GT(brute(mesh, p, kInfinity, is_missed).distance, radius);
      }
      EXPECT_LT(nodes, 30u * 900) << shorter << ' ' << from_hub;
    }
  }
}

TEST(Hierarchy, AgreesWhereOnlySomeTrianglesAreCutIntoSlices) {
  TriangleMesh mesh = shapes::joined(needles(300, true), soup(21, 500));
  mesh.triangles.push_back({300, 300, 300});  // a point at the hub
  const Hierarchy hierarchy(mesh);
  shapes::Random random(22);
  for (int i = 0; i < 1000; ++i) {
    const double off = std::array{0.0, 1e-6, 1e-2, 1.0}[i % 4];
    const dvec3 p = mesh.vertices[random.below(1800)] + off * random.point();
    const Hierarchy::Nearest expected = brute(mesh, p, kInfinity, all), found = hierarchy.nearest(p);
    ASSERT_EQ(found.triangle, expected.triangle) << i;
    ASSERT_EQ(found.distance, expected.distance);
    std::vector<int> seen(mesh.triangles.size());
    hierarchy.for_each_within(p, 0.1, [&](std::uint32_t t) { ++seen[t]; });
    for (std::uint32_t t = 0; t < seen.size(); ++t) {
      ASSERT_LE(seen[t], 1);
      if (std::sqrt(closest(mesh, t, p).distance_squared) <= 0.1) {
        ASSERT_EQ(seen[t], 1);
      }
    }
  }
}

// All triangles around a vertex are at distance 0 from it, and boxes rounded the wrong way would lose some.
TEST(Hierarchy, AgreesAtSharedVertices) {
  shapes::Random random(19);
  TriangleMesh mesh;
  for (int i = 0; i < 400; ++i) mesh.vertices.push_back(random.point());
  for (int i = 0; i < 1500; ++i) mesh.triangles.push_back({random.below(400), random.below(400), random.below(400)});
  const Hierarchy hierarchy(mesh);
  for (const dvec3& p : mesh.vertices) {
    const Hierarchy::Nearest expected = brute(mesh, p, kInfinity, all);
    ASSERT_EQ(hierarchy.nearest(p).triangle, expected.triangle);
    ASSERT_EQ(hierarchy.nearest(p, 0).triangle, expected.distance == 0 ? expected.triangle : Hierarchy::kNone);
  }
}

TEST(Hierarchy, RadiusIsInclusive) {
  const TriangleMesh mesh = soup(3, 800);
  const Hierarchy hierarchy(mesh);
  shapes::Random random(4);
  int beyond = 0;
  for (int i = 0; i < 1000; ++i) {
    const dvec3 p = 2.0 * random.point();
    const double exact = hierarchy.nearest(p).distance;
    EXPECT_EQ(hierarchy.nearest(p, exact).distance, exact);
    EXPECT_EQ(hierarchy.nearest(p, std::nextafter(exact, 0)).triangle, Hierarchy::kNone);
    const double radius = exact * (0.5 + random.below(100) / 100.0);
    const Hierarchy::Nearest found = hierarchy.nearest(p, radius, random.below(800));
    EXPECT_EQ(found.triangle, brute(mesh, p, radius, all).triangle);
    beyond += found.triangle == Hierarchy::kNone;
  }
  EXPECT_GT(beyond, 200);
  EXPECT_EQ(hierarchy.nearest({0, 0, 0}, -1).triangle, Hierarchy::kNone);
}

TEST(Hierarchy, NearestAmongTheAccepted) {
  const TriangleMesh mesh = soup(5, 700);
  const Hierarchy hierarchy(mesh);
  shapes::Random random(6);
  for (int i = 0; i < 600; ++i) {
    const unsigned rest = random.below(7);
    const auto accept = [&](std::uint32_t t) { return t % 7 == rest; };
    const dvec3 p = random.point();
    const Hierarchy::Nearest expected = brute(mesh, p, kInfinity, accept);
    EXPECT_EQ(hierarchy.nearest_if(p, accept).triangle, expected.triangle);
    EXPECT_EQ(hierarchy.nearest_if(p, accept, kInfinity, random.below(700)).triangle, expected.triangle);
  }
  EXPECT_EQ(hierarchy.nearest_if({0, 0, 0}, [](std::uint32_t) { return false; }).triangle, Hierarchy::kNone);
}

TEST(Hierarchy, CommonTriangleOfSeveralPoints) {
  const TriangleMesh mesh = soup(7, 600);
  const Hierarchy hierarchy(mesh);
  shapes::Random random(8);
  for (int i = 0; i < 1200; ++i) {
    const dvec3 centre = random.point() * std::array{1.0, 1.0, 1e3}[i % 3];
    const double spread = std::array{1e-3, 1e-1, 1.0, 10.0}[i % 4];
    std::vector<dvec3> points(1 + i % 4);
    for (dvec3& p : points) p = centre + spread * random.point();
    std::uint32_t triangle = Hierarchy::kNone;
    double distance = kInfinity;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      double farthest = 0;
      for (const dvec3& p : points) farthest = std::max(farthest, std::sqrt(closest(mesh, t, p).distance_squared));
      if (farthest < distance) distance = farthest, triangle = t;
    }
    const Hierarchy::Common found = hierarchy.common(points, kInfinity, -1, random.below(600));
    ASSERT_EQ(found.triangle, triangle);
    ASSERT_NEAR(found.distance, distance, 1e-15 * distance);
    EXPECT_EQ(hierarchy.common(points, 0.999 * distance).triangle, Hierarchy::kNone);
    const Hierarchy::Common early = hierarchy.common(points, kInfinity, 1.5 * distance);
    EXPECT_LE(early.distance, 1.5 * distance);
  }
}

TEST(Hierarchy, TiesGoToTheLowerIndex) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 2}, {1, 0, 2}, {0, 1, 2}};
  for (int i = 0; i < 50; ++i) {
    mesh.triangles.push_back({3, 4, 5});
    mesh.triangles.push_back({0, 1, 2});
  }
  const Hierarchy hierarchy(mesh);
  EXPECT_EQ(hierarchy.nearest({0.2, 0.2, 0.5}).triangle, 1u);
  EXPECT_EQ(hierarchy.nearest({0.25, 0.25, 1}, kInfinity, 77).triangle, 0u);
  EXPECT_EQ(hierarchy.common(std::array{dvec3(0.25, 0.25, 1)}, kInfinity, -1, 77).triangle, 0u);
  EXPECT_EQ(hierarchy.nearest_if({0.2, 0.2, 0.5}, [](std::uint32_t i) { return i > 50; }).triangle, 51u);
  EXPECT_EQ(hierarchy.nearest_if({0.2, 0.2, 0.5}, [](std::uint32_t i) { return i > 98; }).triangle, 99u);
  EXPECT_EQ(hierarchy.nearest_if({0.2, 0.2, 0.5}, [](std::uint32_t i) { return i % 2 == 0; }).triangle, 0u);
}

TEST(Hierarchy, NearVisitsAllWithinTheRadius) {
  TriangleMesh mesh = soup(17, 500);
  for (unsigned i = 0; i < 500; i += 5) mesh.triangles.push_back(mesh.triangles[i]);
  const Hierarchy hierarchy(mesh);
  shapes::Random random(18);
  for (int i = 0; i < 200; ++i) {
    const dvec3 p = random.point() * (i % 10 == 0 ? 1e9 : 1.0);
    const double radius = 0.3 * random.below(5) + (i % 10 == 0 ? 2e9 : 0.0);
    std::vector<int> seen(mesh.triangles.size());
    hierarchy.for_each_within(p, radius, [&](std::uint32_t t) { ++seen[t]; });
    for (std::uint32_t t = 0; t < seen.size(); ++t) {
      EXPECT_LE(seen[t], 1);
      if (std::sqrt(closest(mesh, t, p).distance_squared) <= radius) {
        EXPECT_EQ(seen[t], 1);
      }
    }
  }
  const dvec3 corner = mesh.vertices[7];
  int visited = 0;
  hierarchy.for_each_within(corner, 0, [&](std::uint32_t) { ++visited; });
  EXPECT_LT(visited, 100);  // not simply all of them
}

TEST(Hierarchy, OneTriangleAndAPoint) {
  TriangleMesh mesh{{{1, 2, 3}, {1, 2, 3}}, {{0, 1, 0}}};
  const Hierarchy::Nearest found = Hierarchy(mesh).nearest({1, 2, 7});
  EXPECT_EQ(found.triangle, 0u);
  EXPECT_EQ(found.distance, 4);
  mesh.vertices = {{0, 0, 0}, {0, 0, 0}};
  EXPECT_EQ(Hierarchy(mesh).nearest({3, 4, 0}).distance, 5);
}

// Many equal triangles, alone and among as many others, cause neither deep recursion nor quadratic time.
TEST(Hierarchy, HeapsOfEqualTriangles) {
  const int count = many(300000);
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1e-3, 0, 0}, {0, 1e-3, 0}, {5, 5, 5}};
  mesh.triangles.assign(std::size_t(count), {0, 1, 2});
  const std::size_t polls = polls_of([&] {
    EXPECT_EQ(Hierarchy(mesh).nearest({0, 0, 1}).triangle, 0u);
    mesh.triangles.assign(std::size_t(count), {3, 3, 3});
    const Hierarchy points(mesh);
    for (int i = 0; i < count / 3; ++i) ASSERT_EQ(points.nearest({5, 5, 6}).distance, 1);
    shapes::Random random(9);
    for (int i = 0; i < count; ++i) {
      mesh.vertices.push_back(random.point());
      const unsigned n = unsigned(mesh.vertices.size());
      mesh.triangles.push_back({n - 1, n - 2, n - 3});
    }
    const Hierarchy hierarchy(mesh);
    for (int i = 0; i < 100; ++i) EXPECT_LT(hierarchy.nearest(random.point()).distance, 1);
  });
  EXPECT_LT(polls, 20'000u);
}

TEST(Hierarchy, AnyScaleAndAnyPlace) {
  for (const auto& [scale, offset] : {std::pair{1e-300, 0.0},
                                      {1e-150, 0.0},
                                      {1e-20, 0.0},
                                      {1e-3, 1e6},
                                      {1.0, 1e12},
                                      {1e20, 1e22},
                                      {1e150, 0.0},
                                      {1e300, 1e301}}) {
    const TriangleMesh mesh = soup(10, 400, scale, offset * dvec3(1, -1, 0.5));
    const TriangleMesh unit = soup(10, 400, 1, offset / scale * dvec3(1, -1, 0.5));
    const Hierarchy hierarchy(mesh), reference(unit);
    shapes::Random random(11);
    for (int i = 0; i < 100; ++i) {
      const dvec3 off = random.point() * (i % 2 ? 1.0 : 1e-2);
      const unsigned vertex = random.below(1200);
      const Hierarchy::Nearest found = hierarchy.nearest(mesh.vertices[vertex] + scale * off);
      const Hierarchy::Nearest expected = reference.nearest(unit.vertices[vertex] + off);
      const double rounding = 1e-14 * (1 + offset / scale);
      ASSERT_NE(found.triangle, Hierarchy::kNone) << scale;
      ASSERT_NEAR(found.distance / scale, expected.distance, rounding) << scale;
    }
  }
}

// The points are up to 1e300 away, nearly as far as doubles reach. The tree must not be searched as a whole, and no
// infinity may come out where the answer is finite.
TEST(Hierarchy, PointsFarAway) {
  const TriangleMesh mesh = soup(12, 20000);
  const Hierarchy hierarchy(mesh);
  shapes::Random random(13);
  for (const double far : {1e2, 1e7, 1e9, 1e12, 1e30, 1e155, 1e300}) {
    for (int i = 0; i < 20; ++i) {
      const dvec3 p = far * random.point();
      double expected = kInfinity;
      for (const dvec3& v : mesh.vertices) expected = std::min(expected, glm::length(p / far - v / far) * far);
      const Hierarchy::Nearest found = hierarchy.nearest(p);
      ASSERT_NE(found.triangle, Hierarchy::kNone) << far;
      EXPECT_NEAR(found.distance / expected, 1, 1e-15 + 1 / far / far) << far;
      EXPECT_NEAR(hierarchy.common(std::array{p, p, dvec3(0)}).distance / expected, 1, 8 / far + 1e-7) << far;
      EXPECT_EQ(hierarchy.nearest(p, 0.9 * expected).triangle, Hierarchy::kNone);
    }
  }
  TriangleMesh tiny = soup(14, 100, 1e-200);
  EXPECT_NEAR(Hierarchy(tiny).nearest({3e20, 4e20, 0}).distance, 5e20, 1e5);
}

TEST(Hierarchy, ManyThreadsGetTheSameAnswers) {
  const TriangleMesh mesh = soup(15, 5000);
  const Hierarchy hierarchy(mesh);
  std::vector<std::uint32_t> answers[4];
  std::vector<std::thread> threads;
  for (auto& answer : answers) {
    threads.emplace_back([&] {
      shapes::Random random(16);
      for (int i = 0; i < 2000; ++i) answer.push_back(hierarchy.nearest(random.point()).triangle);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& answer : answers) EXPECT_EQ(answer, answers[0]);
}

}  // namespace
