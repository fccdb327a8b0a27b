// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/distance_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// Means over the piece by dense samples, evenly spread: the middles of n x n equal parts.
struct Truth {
  struct Sample {
    dvec3 weights;
    double distance;
  };

  double least = 1e300, most = 0, mean = 0, mean_square = 0;
  std::vector<Sample> samples;

  Truth(const Simplex& s, const Hierarchy& hierarchy, int n = 24) {
    int count = 0;
    const auto& p = s.corner;
    const auto add = [&](const dvec3& weights) {
      const double d = hierarchy.nearest(weights.x * p[0] + weights.y * p[1] + weights.z * p[2]).distance;
      samples.push_back({weights, d});
      least = std::min(least, d), most = std::max(most, d);
      mean += d, mean_square += d * d;
      ++count;
    };
    if (s.corners == 1) add({1, 0, 0});
    for (int i = 0; s.corners == 2 && i < n; ++i) add({1 - (i + 0.5) / n, (i + 0.5) / n, 0});
    for (int i = 0; s.corners == 3 && i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        for (const int up : {1, 2}) {
          if (up == 2 && i + j + 1 == n) continue;
          const double u = (3 * i + up) / (3.0 * n), v = (3 * j + up) / (3.0 * n);
          add({1 - u - v, u, v});
        }
      }
    }
    mean /= count, mean_square /= count;
  }
};

void expect_holds(const DistanceBounds& b, const Truth& truth, double sampling) {
  EXPECT_LE(b.value.lower, truth.least + 1e-12);
  EXPECT_GE(b.value.upper, truth.most - 1e-12);
  EXPECT_LE(b.mean.lower, truth.mean + sampling);
  EXPECT_GE(b.mean.upper, truth.mean - sampling);
  EXPECT_LE(b.mean_square.lower, truth.mean_square + 2 * truth.most * sampling);
  EXPECT_GE(b.mean_square.upper, truth.mean_square - 2 * truth.most * sampling);
}

/// The linear functions bound the distance at every point, and each quarter of the piece is within one of the four
/// ranges.
void expect_holds_everywhere(const DistanceBounds& b, const Truth& truth) {
  for (const auto& [w, distance] : truth.samples) {
    EXPECT_LE(w.x * b.lower[0] + w.y * b.lower[1] + w.z * b.lower[2], distance + 1e-12);
    EXPECT_GE(w.x * b.upper[0] + w.y * b.upper[1] + w.z * b.upper[2], distance - 1e-12);
  }
  std::array<double, 4> lower, upper;
  for (int i = 0; i < 4; ++i) lower[i] = b.quarters[i].lower, upper[i] = b.quarters[i].upper;
  std::sort(lower.begin(), lower.end());
  std::sort(upper.rbegin(), upper.rend());
  for (int i = 0; i < 4; ++i) {
    std::size_t below = 0, above = 0;
    for (const auto& [w, distance] : truth.samples) {
      below += distance < lower[i] - 1e-12;
      above += distance > upper[i] + 1e-12;
    }
    EXPECT_LE(4 * below, i * truth.samples.size());
    EXPECT_LE(4 * above, i * truth.samples.size());
  }
}

// Pieces of every length, some touching or crossing the surface, against needles, scans and a coarse mesh.
TEST(DistanceBounds, HoldWhateverThePiece) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 1);
  const auto vector = [&] { return dvec3(normal(random), normal(random), normal(random)); };
  TriangleMesh needles;
  for (unsigned i = 0; i < 40; ++i) {
    const dvec3 p = vector();
    needles.vertices.insert(needles.vertices.end(), {p, p + vector(), p + 1e-7 * vector()});
    needles.triangles.push_back(glm::uvec3(3 * i) + glm::uvec3(0, 1, 2));
  }
  for (const TriangleMesh& b : {needles, shapes::torus(40, 0.01), shapes::torus(5), shapes::box(1)}) {
    const Hierarchy hierarchy(b);
    for (int i = 0; i < 400; ++i) {
      const int corners = 1 + i % 3;
      const double reach = std::pow(10, -4 * double(random() % 100) / 100);
      const dvec3 at = b.vertices[random() % b.vertices.size()] + (i % 7 ? reach * vector() : dvec3(0));
      const Simplex s{{at, at + reach * vector(), at + reach * vector()}, corners};
      const Truth truth(s, hierarchy);
      const DistanceBounds bounds = distance_bounds(s, b, hierarchy, Hierarchy::kNone);
      const double longest = std::max(glm::distance(s.corner[0], s.corner[1]), glm::distance(s.corner[0], s.corner[2]));
      expect_holds(bounds, truth, 0.002 * longest);  // 24 parts a side
      expect_holds_everywhere(bounds, truth);
      EXPECT_EQ(bounds.nearest, hierarchy.nearest(s.centroid()).triangle);
      const DistanceBounds hinted = distance_bounds(s, b, hierarchy, std::uint32_t(i % b.triangles.size()));
      EXPECT_EQ(hinted.mean.lower, bounds.mean.lower);
      EXPECT_GT(bounds.steps, 0u);
      const dvec3 point = glm::mix(s.centroid(), s.corner[0], 0.5);
      expect_holds(bounds_around(point, hierarchy.nearest(point), s, b), truth, 0.002 * longest);
    }
  }
}

// A piece that meets a triangle at one corner and is off by rounding at its centroid: the direction of so short a
// difference is that of its rounding, and a plane across it would seem to keep the whole piece away.
TEST(DistanceBounds, HoldWherePiecesNearlyTouch) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal(0, 1);
  for (int i = 0; i < 3000; ++i) {
    TriangleMesh b{{}, {{0, 1, 2}}};
    for (int k = 0; k < 3; ++k) b.vertices.push_back(0.3 * dvec3(normal(random), normal(random), normal(random)));
    const auto& v = b.vertices;
    const dvec3 up = glm::normalize(glm::cross(v[1] - v[0], v[2] - v[0]));
    const double height = std::pow(10, -6 - 9 * uniform(random));
    Simplex s{{v[0], v[1], v[2]}, 3};
    for (dvec3& p : s.corner) p = glm::mix(p, (v[0] + v[1] + v[2]) / 3.0, 0.1);
    const dvec3 touching = s.corner[i % 3];
    for (dvec3& p : s.corner) p += p == touching ? dvec3(0) : height * uniform(random) * up;
    const DistanceBounds bounds = distance_bounds(s, b, Hierarchy(b), Hierarchy::kNone);
    EXPECT_LT(bounds.value.lower, 1e-15) << i << ' ' << height;
  }
}

TEST(DistanceBounds, ExactOverAPlane) {
  const TriangleMesh plane = shapes::grid(4);  // many triangles, one plane
  const Hierarchy hierarchy(plane);
  const Simplex s{{{{0.4, 0.4, 0.1}, {0.6, 0.41, 0.2}, {0.45, 0.6, 0.3}}}, 3};
  const DistanceBounds bounds = distance_bounds(s, plane, hierarchy, Hierarchy::kNone);
  EXPECT_NEAR(bounds.value.lower, 0.1, 1e-14);
  EXPECT_NEAR(bounds.mean.lower, 0.2, 1e-14);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(bounds.lower[i], 0.1 * (i + 1), 1e-13);
  }
}

// Over the ridge of a roof no triangle is nearest to the whole piece: each quarter has its own.
TEST(DistanceBounds, QuartersHaveTheirOwnTriangles) {
  const TriangleMesh roof{{{-1, -1, -0.2}, {-1, 1, -0.2}, {0, -1, 0}, {0, 1, 0}, {1, -1, -0.2}, {1, 1, -0.2}},
                          {{0, 2, 1}, {1, 2, 3}, {2, 4, 3}, {3, 4, 5}}};
  const Hierarchy hierarchy(roof);
  const Simplex s{{{{-0.1, -0.1, -0.1}, {0.1, -0.1, -0.1}, {0, 0.1, -0.1}}}, 3};
  const Truth truth(s, hierarchy, 96);
  const DistanceBounds bounds = distance_bounds(s, roof, hierarchy, Hierarchy::kNone);
  const TriangleMesh& b = roof;
  const glm::uvec3& t = b.triangles[bounds.nearest];
  double alone = 0;
  for (const dvec3& p : s.corner) {
    alone += std::sqrt(closest_point(p, b.vertices[t.x], b.vertices[t.y], b.vertices[t.z]).distance_squared) / 3;
  }
  EXPECT_LT(bounds.mean.upper - truth.mean, 0.6 * (alone - truth.mean));
}

// The surfaces almost parallel: ten times smaller pieces, at least forty times narrower ranges.
TEST(DistanceBounds, NarrowFasterThanThePieces) {
  const TriangleMesh torus = shapes::torus(100);
  const Hierarchy hierarchy(torus);
  double before = 0;
  for (const double length : {0.02, 0.002}) {
    const Simplex s{{{{1.5, -length, -length}, {1.5, length, -length}, {1.5, 0, length}}}, 3};
    const DistanceBounds bounds = distance_bounds(s, torus, hierarchy, Hierarchy::kNone);
    const double width = bounds.mean.upper - bounds.mean.lower;
    if (before > 0) {
      EXPECT_LT(width, before / 40);
    }
    before = width;
  }
}

}  // namespace
