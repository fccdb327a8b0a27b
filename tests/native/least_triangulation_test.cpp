// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/least_triangulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "base/call.h"
#include "many.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using Triangles = std::vector<glm::uvec3>;

const TriangulationRules kAnything{[](std::uint32_t, std::uint32_t) { return true; },
                                   [](const glm::uvec3&) { return true; }};

double weight(const std::vector<dvec3>& p, const glm::uvec3& t) {
  const dvec3 u = p[t.y] - p[t.x], v = p[t.z] - p[t.x], w = p[t.z] - p[t.y];
  return glm::length(glm::cross(u, v)) * (glm::dot(u, u) + glm::dot(v, v) + glm::dot(w, w));
}

double weight(const std::vector<dvec3>& p, const Triangles& triangles) {
  double sum = 0;
  for (const glm::uvec3& t : triangles) sum += weight(p, t);
  return sum;
}

/// The least sum over all triangulations of the part (i, j), by trying each.
double least(const std::vector<dvec3>& p, const TriangulationRules& rules, unsigned i, unsigned j) {
  if (j - i < 2) return 0;
  const bool is_whole = i == 0 && j + 1 == p.size();
  if (!is_whole && !rules.admits_edge(i, j)) return std::numeric_limits<double>::infinity();
  double best = std::numeric_limits<double>::infinity();
  for (unsigned k = i + 1; k < j; ++k) {
    if (!rules.admits_triangle({i, k, j})) continue;
    best = std::min(best, least(p, rules, i, k) + weight(p, glm::uvec3(i, k, j)) + least(p, rules, k, j));
  }
  return best;
}

/// Whether the triangles fill the polygon: each edge of it is of one triangle, each other edge of two.
bool fills(std::size_t n, const Triangles& triangles) {
  std::multiset<std::pair<unsigned, unsigned>> edges;
  for (const glm::uvec3& t : triangles) {
    if (!(t.x < t.y && t.y < t.z && t.z < n)) return false;
    edges.insert({t.x, t.y}), edges.insert({t.y, t.z}), edges.insert({t.x, t.z});
  }
  for (unsigned i = 0; i < n; ++i) {
    if (edges.count(std::minmax(i, unsigned((i + 1) % n))) != 1) return false;
  }
  for (const auto& [i, j] : edges) {
    const bool at_rim = j == i + 1 || (i == 0 && j + 1 == n);
    if (!at_rim && edges.count({i, j}) != 2) return false;
  }
  return triangles.size() + 2 == n;
}

TEST(LeastTriangulation, ATriangleAndAQuad) {
  const std::vector<dvec3> triangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(least_triangulation(triangle, kAnything), Triangles(1, {0, 1, 2}));
  // The short diagonal of a rhombus.
  const Triangles quad =
      least_triangulation(std::vector<dvec3>{{-2, 0, 0}, {0, -1, 0}, {2, 0, 0}, {0, 1, 0}}, kAnything);
  EXPECT_EQ(std::set<unsigned>({quad[0].x, quad[0].z}), std::set<unsigned>({0, 3}));
  EXPECT_EQ(quad[0].y, 1u);
}

TEST(LeastTriangulation, OfAConvexPolygonIsDelaunay) {
  shapes::Random random(4);
  for (int round = 0; round < many(30); ++round) {
    std::vector<double> angles(4 + random.below(30));
    for (double& a : angles) a = 2 * std::numbers::pi * random.share();
    std::sort(angles.begin(), angles.end());
    std::vector<dvec3> p;
    for (const double a : angles) p.emplace_back(2 * std::cos(a), std::sin(a), 0);  // an ellipse: no four on a circle
    const Triangles triangles = least_triangulation(p, kAnything);
    ASSERT_TRUE(fills(p.size(), triangles));
    for (const glm::uvec3& t : triangles) {
      const dvec3 b = p[t.y] - p[t.x], c = p[t.z] - p[t.x];
      const double d = 2 * (b.x * c.y - b.y * c.x), b2 = glm::dot(b, b), c2 = glm::dot(c, c);
      const dvec3 centre((c.y * b2 - b.y * c2) / d, (b.x * c2 - c.x * b2) / d, 0);
      for (const dvec3& q : p) {
        EXPECT_GE(glm::length(q - p[t.x] - centre), glm::length(centre) * (1 - 1e-6));
      }
    }
  }
}

TEST(LeastTriangulation, PointsOnALineLeaveNoTriangleWithoutAnArea) {
  std::vector<dvec3> square;
  for (int k = 0; k < 4; ++k) {
    const dvec3 from[4] = {{0, 0, 0}, {5, 0, 0}, {5, 5, 0}, {0, 5, 0}},
                to[4] = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}};
    for (int i = 0; i < 5; ++i) square.push_back(from[k] + double(i) * to[k]);
  }
  const Triangles triangles = least_triangulation(square, kAnything);
  ASSERT_TRUE(fills(square.size(), triangles));
  for (const glm::uvec3& t : triangles) EXPECT_GT(weight(square, t), 0);
}

TEST(LeastTriangulation, IsTheLeastOfAllThatAreAdmitted) {
  shapes::Random random(11);
  std::size_t none = 0, some = 0;
  for (int round = 0; round < many(300); ++round) {
    std::vector<dvec3> p(3 + random.below(6));
    for (dvec3& q : p) q = random.point();
    std::set<std::pair<unsigned, unsigned>> edges;
    std::set<std::array<unsigned, 3>> faces;
    const double share = 0.5 * random.share();
    for (unsigned i = 0; i < p.size(); ++i) {
      for (unsigned j = i + 1; j < p.size(); ++j) {
        if (random.share() < share) edges.insert({i, j});
        for (unsigned k = i + 1; k < j; ++k) {
          if (random.share() < share) faces.insert({i, k, j});
        }
      }
    }
    const TriangulationRules rules{[&](std::uint32_t i, std::uint32_t j) {
                                     return !edges.contains({i, j});
                                   },
                                   [&](const glm::uvec3& t) {
                                     return !faces.contains({t.x, t.y, t.z});
                                   }};
    const double expected = least(p, rules, 0, unsigned(p.size()) - 1);
    const Triangles found = least_triangulation(p, rules);
    ASSERT_EQ(found.empty(), std::isinf(expected));
    if (found.empty()) {
      ++none;
      continue;
    }
    ++some;
    EXPECT_TRUE(fills(p.size(), found));
    for (const glm::uvec3& t : found) EXPECT_TRUE(rules.admits_triangle(t));
    EXPECT_NEAR(weight(p, found), expected, 1e-12 * expected);
  }
  EXPECT_GT(none, 5u);
  EXPECT_GT(some, 5u);
}

TEST(LeastTriangulation, AsksAboutNothingTwiceAndAboutNothingBeyondWhatIsRefused) {
  std::vector<dvec3> p;
  for (int i = 0; i < 200; ++i)
    p.emplace_back(std::cos(i * std::numbers::pi / 100), std::sin(i * std::numbers::pi / 100), 0);
  std::set<std::pair<unsigned, unsigned>> edges;
  std::size_t triangles = 0;
  TriangulationRules rules{[&](std::uint32_t i, std::uint32_t j) {
                             EXPECT_TRUE(edges.insert({i, j}).second);
                             return true;
                           },
                           [&](const glm::uvec3&) {
                             ++triangles;
                             return false;
                           }};
  EXPECT_TRUE(least_triangulation(p, rules).empty());
  EXPECT_EQ(edges.size(), 198u);  // the edges across one corner; all wider parts have no triangulation
  EXPECT_EQ(triangles, 198u);
}

TEST(LeastTriangulation, StopsWhenTheCallIsCancelled) {
  std::vector<dvec3> p;
  for (int i = 0; i < 300; ++i)
    p.emplace_back(std::cos(i * std::numbers::pi / 150), std::sin(i * std::numbers::pi / 150), 0);
  const std::size_t polls = polls_of([&] { least_triangulation(p, kAnything); });
  ASSERT_GT(polls, 1000u);
  const Counted stops(polls / 2);
  EXPECT_THROW(least_triangulation(p, kAnything), Cancelled);
}

}  // namespace
