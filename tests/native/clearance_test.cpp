// SPDX-License-Identifier: GPL-3.0-or-later
// Judged by crossings() of all pairs, with all vertices at the end of their rooms.
#include "motion/clearance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "polls.h"
#include "shapes.h"
#include "topology/crossings.h"

namespace {

using namespace tolvol;
using glm::dvec3;

struct Scene {
  explicit Scene(TriangleMesh m) : mesh(std::move(m)), volume(mesh.vertices, mesh.triangles, space, 0.1) {
    indices = shapes::indices(mesh);
    moving = std::make_unique<MovingMesh>(volume, space, indices, 3, mesh.vertices.size(), 1);
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) faces.push_back(f);
    Team alone(1);
    near = MovingFaces(indices, 3, mesh.vertices.size());
    near.build([&](std::uint32_t v) { return Box{mesh.vertices[v], mesh.vertices[v]}; }, alone);
    clearance = std::make_unique<Clearance>(*moving, mesh.vertices);
    vertices.resize(mesh.vertices.size());
    std::iota(vertices.begin(), vertices.end(), 0u);
  }
  void renew() { clearance->renew(mesh.vertices, near); }

  /// How far the vertex may go along `way`, to a thousandth of `most`.
  double room(std::uint32_t v, const dvec3& way, double most = 1) const {
    double inside = 0;
    for (double step = most / 2; step > most / 1024; step /= 2) {
      if (clearance->has(v, mesh.vertices[v] + (inside + step) * way)) inside += step;
    }
    return inside;
  }

  TriangleMesh mesh;
  StoredSpace space{glm::dmat4(1), Storage::float64};
  ToleranceVolume volume;
  std::vector<std::uint32_t> indices, faces, vertices;
  std::unique_ptr<MovingMesh> moving;
  MovingFaces near;
  std::unique_ptr<Clearance> clearance;
};

std::size_t pairs(const TriangleMesh& mesh) {
  Team alone(1);
  return crossings(mesh.vertices, mesh.triangles, 1'000'000, alone, nullptr).pairs.size();
}

TriangleMesh hollow(unsigned n, double wall) {
  return shapes::joined(shapes::sphere(n), shapes::turned(shapes::sphere(n, 1 - wall)));
}

TEST(Clearance, NoVertexHasRoomBeforeItIsRenewed) {
  Scene scene(shapes::torus(8));
  EXPECT_FALSE(scene.clearance->has(3, scene.mesh.vertices[3]));
  scene.renew();
  EXPECT_TRUE(scene.clearance->has(3, scene.mesh.vertices[3]));
  EXPECT_FALSE(scene.clearance->has(3, scene.mesh.vertices[3] + dvec3(0.5)));
}

TEST(Clearance, MostVerticesOfASmoothSurfaceHaveRoom) {
  for (const TriangleMesh& mesh : {shapes::torus(24), shapes::sphere(12), shapes::grid(12)}) {  // the last one is open
    Scene scene(mesh);
    scene.renew();
    std::size_t roomy = 0;
    for (const std::uint32_t v : scene.vertices) {
      const dvec3 p = mesh.vertices[v];
      const auto ring = scene.moving->ring(v);
      double edge = 1;
      for (const std::uint32_t f : ring) {
        for (const std::uint32_t other : scene.moving->corners_of(f)) {
          if (other != v) edge = std::min(edge, glm::length(mesh.vertices[other] - p));
        }
      }
      roomy += scene.room(v, glm::normalize(dvec3(1, 2, 3))) > edge / 30;
    }
    EXPECT_GT(roomy, mesh.vertices.size() * 8 / 10);
  }
}

TEST(Clearance, BetweenTwoSheetsEachHasHalfTheWay) {
  TriangleMesh upper = shapes::grid(4);
  for (dvec3& p : upper.vertices) p.z = 0.02;
  Scene scene(shapes::joined(shapes::grid(4), upper));
  scene.renew();
  for (const std::uint32_t v : scene.vertices) EXPECT_NEAR(scene.room(v, {0, 0, 1}, 0.1), 0.01, 0.0003);
}

TEST(Clearance, NothingCrossesWhileAllAreInTheirRooms) {
  shapes::Random random(8);
  std::size_t moved = 0, without = 0, steps = 0;
  TriangleMesh rough = hollow(6, 0.05);
  for (dvec3& p : rough.vertices) p *= 1 + 0.006 * random.point().x;
  for (const TriangleMesh& start : {hollow(8, 0.02), shapes::torus(16, 0.01), rough, shapes::grid(9)}) {
    Scene scene(start);
    const std::size_t before = pairs(scene.mesh);
    ASSERT_EQ(before, 0u);
    scene.renew();
    for (int step = 0; step < 12; ++step) {
      // Each goes along a random way to the end of its room; some leave it, and get another one there.
      TriangleMesh now = scene.mesh, next = scene.mesh;
      const double most = 0.2;
      for (const std::uint32_t v : scene.vertices) {
        const dvec3 way = glm::normalize(random.point());
        const double room = scene.room(v, way, most);
        now.vertices[v] += room * way;
        if (random.below(4) == 0) next.vertices[v] += (1.1 * room + 0.001) * way;
        (room > 0 ? moved : without) += 1;
      }
      // Whoever rests is looked at by others.
      Team alone(1);
      for (const glm::uvec2& p : crossings(now.vertices, now.triangles, 1'000'000, alone, nullptr).pairs) {
        EXPECT_TRUE(scene.clearance->rests(p.x) || scene.clearance->rests(p.y)) << step;
      }
      if (pairs(next) == 0) scene.mesh = next, ++steps;
      scene.renew();
    }
  }
  EXPECT_GT(moved, 2 * without);
  EXPECT_GT(steps, 24u);
}

TEST(Clearance, WhereFacesCrossOrTurnOverThereIsNoRoom) {
  TriangleMesh other = shapes::sphere(5);
  for (dvec3& p : other.vertices) p.x += 1.1;
  Scene scene(shapes::joined(shapes::sphere(5), other));
  scene.renew();
  Team alone(1);
  for (const glm::uvec2& pair : crossings(scene.mesh.vertices, scene.mesh.triangles, 10'000, alone, nullptr).pairs) {
    for (const std::uint32_t face : {pair.x, pair.y}) {
      for (const std::uint32_t v : scene.moving->corners_of(face)) EXPECT_EQ(scene.room(v, {0, 0, 1}), 0);
    }
  }
  TriangleMesh folded = shapes::grid(6);
  folded.vertices[24] += dvec3(0.25, 0, 0);  // over the faces beside it
  Scene plate(folded);
  plate.renew();
  EXPECT_EQ(plate.room(24, {0, 0, 1}), 0);
  EXPECT_GT(plate.room(0, {0, 0, 1}), 0);
}

// The boxes of faces at a hub all meet, but none of these faces is another one's neighbour across a gap.
TEST(Clearance, AroundAHubAFaceIsComparedWithFew) {
  constexpr std::uint32_t kCount = 4000;
  TriangleMesh fan{{dvec3(0)}, {}};
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCount, radius = i % 2 == 0 ? 1 : 0.3, y = radius * std::sin(angle);
    fan.vertices.emplace_back(radius * std::cos(angle), 0.8 * y, 0.6 * y);
    fan.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % kCount);
  }
  Scene scene(fan);
  // A face polls once for each 64 that it comes past.
  EXPECT_LT(polls_of([&] { scene.renew(); }), kCount);
}

TEST(Clearance, BoxesHoldFacesInTheirRooms) {
  Scene scene(shapes::torus(12));
  scene.renew();
  for (const std::uint32_t f : scene.faces) {
    const Box box = scene.near.box(f, scene.clearance->in_room());
    for (const std::uint32_t v : scene.moving->corners_of(f)) {
      for (const dvec3 way : {dvec3(1, 0, 0), dvec3(0, -1, 0), dvec3(0, 0, 1)}) {
        const dvec3 at = scene.mesh.vertices[v] + scene.room(v, way) * way;
        Box alone;
        alone.add(at);
        EXPECT_TRUE(meet(alone, box));
      }
    }
  }
}

}  // namespace
