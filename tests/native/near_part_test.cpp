// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/near_part.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "geometry/closest_point.h"
#include "geometry/hierarchy.h"
#include "measure/hausdorff.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

TriangleMesh mesh_of(const NearPart& part, const TriangleMesh& whole) {
  TriangleMesh mesh{whole.vertices, part.triangles};
  for (const NearPart::Cut& cut : part.cuts) mesh.vertices.push_back(cut.in(Frame(), whole));
  return mesh;
}

double size_of(const TriangleMesh& mesh) {
  double size = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) size = std::max(size, glm::length(mesh.vertices[t[k]]));
  }
  return size;
}

// The distances from a stay as they are, whatever is cut off.
TEST(NearPart, DistancesStay) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0, 1);
  const auto vector = [&] { return dvec3(normal(random), normal(random), normal(random)); };
  int cut = 0, left_out = 0;
  for (int round = 0; round < 400; ++round) {
    const double far = std::pow(10, 1 + round % 5);
    const dvec3 at = 100.0 * vector();
    TriangleMesh a, b;
    for (unsigned i = 0; i < 12; ++i) {
      for (int k = 0; k < 3; ++k) {
        a.vertices.push_back(at + vector());
        b.vertices.push_back(at + (random() % 3 ? far : 1.0) * vector());
      }
      a.triangles.push_back(glm::uvec3(3 * i) + glm::uvec3(0, 1, 2));
      b.triangles.push_back(a.triangles.back());
    }
    const NearPart part = near_part(a, b);
    cut += int(part.cuts.size());
    left_out += part.triangles.size() < b.triangles.size();
    const Hierarchy whole(b), near(mesh_of(part, b));
    for (const glm::uvec3& t : a.triangles) {
      for (int i = 0; i < 10; ++i) {
        const dvec3 p = glm::mix(glm::mix(a.vertices[t.x], a.vertices[t.y], (i % 4) / 3.0), a.vertices[t.z], i / 10.0);
        EXPECT_NEAR(near.nearest(p).distance, whole.nearest(p).distance, 1e-14 * far * 100) << round;
      }
    }
  }
  EXPECT_GT(cut, 400);
  EXPECT_GT(left_out, 20);
}

TEST(NearPart, FarCornersAreCutOff) {
  const TriangleMesh torus = shapes::torus(30);
  for (const double far : {1e3, 1e10, 1e19, 1e30, 1e300}) {
    for (const dvec3& towards : {dvec3(1, 0.3, -1), dvec3(-1, 0, 0), dvec3(0, 0, 1)}) {
      TriangleMesh target = torus;
      target.vertices[7] = far * towards;
      const NearPart part = near_part(torus, target);
      EXPECT_FALSE(part.cuts.empty());
      EXPECT_LT(size_of(mesh_of(part, target)), 400) << far;
    }
  }
  TriangleMesh target = torus;  // and a triangle far from everything is left out
  for (const dvec3& p : {dvec3(1e9, 0, 0), dvec3(1e9, 1e9, 0), dvec3(1e9, 0, -1e12)}) target.vertices.push_back(p);
  target.triangles.push_back(glm::uvec3(900) + glm::uvec3(0, 1, 2));
  EXPECT_EQ(near_part(torus, target).triangles, torus.triangles);
}

// One that passes close by is kept whole, although no corner of it is near.
TEST(NearPart, TrianglesThatPassAreKept) {
  const TriangleMesh torus = shapes::torus(30);
  TriangleMesh target = torus;
  for (const dvec3& p : {dvec3(1e4, 0, 2), dvec3(-1e4, 1e4, 2), dvec3(-1e4, -1e4, 2)}) target.vertices.push_back(p);
  target.triangles = {torus.triangles[0], glm::uvec3(900) + glm::uvec3(0, 1, 2)};
  EXPECT_EQ(near_part(torus, target).triangles, target.triangles);
}

TEST(NearPart, WhatIsNotFarStaysAsItIs) {
  const TriangleMesh torus = shapes::torus(30), box = shapes::box(2);
  for (const auto& [a, b] : {std::pair{torus, box}, {box, torus}, {torus, torus}}) {
    const NearPart part = near_part(a, b);
    EXPECT_EQ(part.triangles, b.triangles);
    EXPECT_TRUE(part.cuts.empty());
  }
}

// Every edge that can be nearest has the faces that it has in the whole mesh, also beside triangles that stay because
// they open widely at their only near corner.
TEST(NearPart, EdgesKeepTheirFaces) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal(0, 1);
  int cuts = 0, divided = 0;
  for (int round = 0; round < 100; ++round) {
    const TriangleMesh torus = shapes::torus(10);
    TriangleMesh target = torus;
    for (int i = 0; i < 8; ++i) {
      target.vertices[random() % 100] =
          std::pow(10, 1 + 0.01 * double(random() % 300)) * dvec3(normal(random), normal(random), normal(random));
    }
    const NearPart part = near_part(torus, target);
    const TriangleMesh near = mesh_of(part, target);
    EXPECT_EQ(part.whole, near.triangles == target.triangles);
    cuts += int(part.cuts.size());
    divided += near.triangles.size() > target.triangles.size();
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> faces;
    for (const glm::uvec3& t : near.triangles) {
      for (int k = 0; k < 3; ++k) ++faces[{t[k], t[(k + 1) % 3]}];
    }
    for (const auto& [ends, count] : faces) {
      const dvec3 &p = near.vertices[ends.first], &q = near.vertices[ends.second];
      const double distance = std::sqrt(closest_point(dvec3(0), p, q, q).distance_squared);
      if (distance > 3) continue;  // a torus of this size is within 3 of the origin, and so is what is nearest to it
      EXPECT_EQ(count, 1) << round;
      EXPECT_EQ((faces.count({ends.second, ends.first})), 1u) << round;
    }
  }
  EXPECT_GT(cuts, 400);
  EXPECT_GT(divided, 20);
}

// A far corner neither widens the interval of the distance nor moves it.
TEST(NearPart, FarCornersDoNotWidenTheDistance) {
  const TriangleMesh torus = shapes::torus(30);
  double first = 0;
  for (const double far : {1e4, 1e10, 1e12, 1e14, 1e17, 1e19, 1e30, 1e300}) {
    TriangleMesh target = torus;
    target.vertices[7] = far * dvec3(1, 0.3, -1);
    const HausdorffInterval h = hausdorff(torus, target);
    EXPECT_LE(h.upper - h.lower, 0.001 * h.upper) << far;
    if (first == 0) first = h.upper;
    EXPECT_NEAR(h.upper, first, 0.01 * first) << far;
  }
}

}  // namespace
