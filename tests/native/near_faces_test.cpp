// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/near_faces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <set>

#include "topology/crossings.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kTurn = 2 * std::numbers::pi;

/// A flat fan of n triangles around vertex 0, turned out of the planes of the axes.
TriangleMesh fan(unsigned n, double inner = 1) {
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, 0);
  for (unsigned i = 0; i < n; ++i) {
    const double angle = kTurn * i / n, radius = i % 2 ? inner : 1;
    const double x = radius * std::cos(angle), y = radius * std::sin(angle);
    mesh.vertices.emplace_back(x, 0.8 * y, 0.6 * y);
    mesh.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % n);
  }
  return mesh;
}

struct Faces {
  std::vector<std::uint32_t> numbers;
  std::vector<Corners> corners;
  NearFaces near;

  explicit Faces(const TriangleMesh& mesh) : numbers(mesh.triangles.size()) {
    std::iota(numbers.begin(), numbers.end(), 0u);
    for (const glm::uvec3& t : mesh.triangles) {
      corners.push_back({mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]});
    }
    Team team(1);
    near = NearFaces(
        numbers, [&](std::size_t i) { return corners[i]; }, NearFaces::hubs_of(mesh.triangles, mesh.vertices.size()),
        team);
  }
  std::vector<std::uint32_t> found(const Corners& own) const {
    std::vector<std::uint32_t> faces;
    near.for_each_near(own, [&](std::uint32_t face) {
      faces.push_back(face);
      return true;
    });
    return faces;
  }
  /// Compares what is found near `own` with all faces that it crosses.
  void expect_all_found(const Corners& own, const std::set<std::uint32_t>& gone = {}) const {
    const std::vector<std::uint32_t> faces = found(own);
    const std::set<std::uint32_t> once(faces.begin(), faces.end());
    EXPECT_EQ(once.size(), faces.size()) << "a face came twice";
    for (const std::uint32_t i : numbers) {
      if (gone.contains(i)) {
        EXPECT_FALSE(once.contains(i)) << i << " is gone";
      } else if (faces_cross(own, corners[i])) {
        EXPECT_TRUE(once.contains(i)) << i;
      }
    }
  }
};

/// Two flat fans of n triangles each, which together are a rectangle, turned out of the planes of the axes: their hubs
/// are opposite corners, and so all of their slivers run aslant.
TriangleMesh two_fans(unsigned n) {
  TriangleMesh mesh;
  for (const double y : {0.0, 0.35}) {
    for (unsigned i = 0; i <= n; ++i) mesh.vertices.emplace_back(double(i) / n, 0.8 * y, 0.6 * y);
  }
  for (unsigned i = 0; i < n; ++i) {
    mesh.triangles.emplace_back(i, i + 1, 2 * n + 1);
    mesh.triangles.emplace_back(n + 1 + i, 0, n + 2 + i);
  }
  return mesh;
}

/// A fan with an accordion's rim, faces across it, and degenerate faces that run from the hub through others.
TriangleMesh crossed_fan(std::mt19937& random) {
  TriangleMesh mesh = fan(300, 0.4);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (int i = 0; i < 30; ++i) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    const double angle = coordinate(random) * std::numbers::pi, y = std::sin(angle), length = coordinate(random);
    mesh.vertices.push_back(length * dvec3(std::cos(angle), 0.8 * y, 0.6 * y));
    mesh.vertices.push_back(2.0 * mesh.vertices.back());
    mesh.vertices.emplace_back(coordinate(random), coordinate(random), coordinate(random));
    mesh.triangles.emplace_back(0, first, first + 1);
    mesh.triangles.emplace_back(first, first + 1, first + 2);
    mesh.triangles.emplace_back(0, first, first + 2);
    mesh.triangles.emplace_back(0, first, first);
    mesh.triangles.emplace_back(0, first + 1, 1 + static_cast<std::uint32_t>(i));
  }
  return mesh;
}

TEST(NearFaces, HaveAllThatCrossAmongFacesAtAHub) {
  std::mt19937 random(1);
  const Faces faces(crossed_fan(random));
  for (const Corners& own : faces.corners) faces.expect_all_found(own);
}

TEST(NearFaces, HaveAllThatCrossAfterChanges) {
  std::mt19937 random(2);
  Faces faces(crossed_fan(random));
  std::set<std::uint32_t> gone;
  for (std::uint32_t i = 0; i < faces.numbers.size(); i += 3) {
    if (i % 2) {
      gone.insert(i), faces.near.remove(i);
    } else {  // Some faces leave the hub, others get another rim.
      faces.corners[i][i % 4 ? 0 : 1] += dvec3(0.1, 0.05, 0.3);
      faces.near.change(i, faces.corners[i]);
    }
  }
  for (const std::uint32_t i : faces.numbers) {
    if (!gone.contains(i)) faces.expect_all_found(faces.corners[i], gone);
  }
}

// Differences of these coordinates overflow.
TEST(NearFaces, HaveAllThatCrossAtHugeCoordinates) {
  TriangleMesh mesh = fan(300, 0.4);
  for (dvec3& p : mesh.vertices) p *= 1e308;
  mesh.vertices[0].x = -1e308;
  mesh.triangles.push_back(mesh.triangles[5]);
  const Faces faces(mesh);
  ASSERT_TRUE(faces_cross(faces.corners[5], faces.corners[300]));
  for (const Corners& own : faces.corners) faces.expect_all_found(own);
}

TEST(NearFaces, AreFewAtAHub) {
  for (const unsigned n : {1000u, 8000u}) {
    // A box around a long edge opposite the hub is seen from there over more than half of a right angle.
    for (const double inner : {1.0, 0.05}) {
      const Faces faces(fan(n, inner));
      std::size_t found = 0;
      for (const Corners& own : faces.corners) found += faces.found(own).size();
      EXPECT_LE(found, 12u * n) << "without the hub's trees about n^2 / 4";
    }
  }
}

TEST(NearFaces, AreFewAtHubsWhoseFacesRunAslant) {
  for (const unsigned n : {500u, 4000u}) {
    Faces faces(two_fans(n));
    const auto found_by_all = [&] {
      std::size_t found = 0;
      for (const Corners& own : faces.corners) found += faces.found(own).size();
      return found;
    };
    EXPECT_LE(found_by_all(), 24u * n) << "by their boxes about n^2";
    const dvec3 hub = faces.corners[0][2], moved = hub + dvec3(-0.001, 0.002, 0.001);
    for (const std::uint32_t i : faces.numbers) {
      for (dvec3& corner : faces.corners[i]) {
        if (corner == hub) corner = moved;
      }
      faces.near.change(i, faces.corners[i]);
    }
    EXPECT_LE(found_by_all(), 24u * n) << "after one hub has gone elsewhere";
    if (n > 500) continue;
    for (std::uint32_t i = 0; i < faces.numbers.size(); i += 7) faces.expect_all_found(faces.corners[i]);
  }
}

TEST(NearFaces, WithFewerFacesAtAVertexThereIsNoHub) {
  for (const unsigned n : {NearFaces::kHub - 1, NearFaces::kHub}) {
    const TriangleMesh mesh = fan(n);
    EXPECT_EQ(NearFaces::hubs_of(mesh.triangles, mesh.vertices.size()).empty(), n < NearFaces::kHub);
  }
}

TEST(NearFaces, ASearchEndsWhenAVisitSaysSo) {
  const Faces faces(fan(1000));
  int visits = 0;
  faces.near.for_each_near(faces.corners[0], [&](std::uint32_t) { return ++visits < 2; });
  EXPECT_EQ(visits, 2);
}

TEST(Crossings, OfAFanAreThoseOfBruteForce) {
  std::mt19937 random(3);
  const TriangleMesh mesh = crossed_fan(random);
  const Faces faces(mesh);
  std::vector<glm::uvec2> expected;
  for (std::uint32_t i = 0; i < faces.numbers.size(); ++i) {
    for (std::uint32_t k = i + 1; k < faces.numbers.size(); ++k) {
      if (faces_cross(faces.corners[i], faces.corners[k])) expected.emplace_back(i, k);
    }
  }
  Team team(1);
  EXPECT_GT(expected.size(), 500u);
  EXPECT_EQ(crossings(mesh.vertices, mesh.triangles, expected.size(), team, nullptr).pairs, expected);
}

}  // namespace
