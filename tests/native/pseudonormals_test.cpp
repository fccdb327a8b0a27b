// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/pseudonormals.h"

#include <gtest/gtest.h>

#include "geometry/hierarchy.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// How often the mesh goes around p: 1 inside of a closed mesh, 0 outside. Shares nothing with normals.
double winding_number(const TriangleMesh& mesh, const dvec3& p) {
  double sum = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    const dvec3 a = mesh.vertices[t.x] - p, b = mesh.vertices[t.y] - p, c = mesh.vertices[t.z] - p;
    const double x = glm::length(a), y = glm::length(b), z = glm::length(c);
    sum += std::atan2(glm::dot(a, glm::cross(b, c)),
                      x * y * z + glm::dot(a, b) * z + glm::dot(b, c) * x + glm::dot(c, a) * y);
  }
  return sum / (2 * std::numbers::pi);
}

bool inside(const TriangleMesh& mesh, const dvec3& p) {
  const Hierarchy::Nearest q = Hierarchy(mesh).nearest(p);
  return Pseudonormals(mesh).inside(p, q.triangle, {q.point, q.weights, q.distance * q.distance});
}

/// The share of random points about the mesh, most of them near vertices and edges, whose side is wrong.
double wrong_share(const TriangleMesh& mesh, const TriangleMesh& truth) {
  const Hierarchy hierarchy(mesh);
  const Pseudonormals normals(mesh);
  std::mt19937 engine(1);
  std::normal_distribution<double> normal(0, 0.1);
  std::uniform_int_distribution<std::size_t> vertex(0, truth.vertices.size() - 1);
  int wrong = 0, count = 0;
  for (int i = 0; i < 4000; ++i) {
    const dvec3 &a = truth.vertices[vertex(engine)], &b = truth.vertices[vertex(engine)];
    const dvec3 p = glm::mix(a, b, i % 3 * 0.1) + dvec3(normal(engine), normal(engine), normal(engine));
    const Hierarchy::Nearest q = hierarchy.nearest(p);
    if (q.distance < 1e-9) continue;
    ++count;
    wrong += normals.inside(p, q.triangle, {q.point, q.weights, 0}) != (winding_number(truth, p) > 0.5);
  }
  EXPECT_GT(count, 3900);
  return wrong / double(count);
}
double wrong_share(const TriangleMesh& mesh) { return wrong_share(mesh, mesh); }

/// A tetrahedron that leans over a plain, on the top of an inverted pyramid; closed.
TriangleMesh leaning_spike() {
  return {{{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 0, 0}, {4, 0, 2}, {0, 0, -9}},
          {{0, 1, 4},
           {1, 5, 4},
           {1, 2, 5},
           {2, 3, 5},
           {3, 6, 5},
           {3, 0, 6},
           {0, 4, 6},
           {4, 5, 7},
           {5, 6, 7},
           {6, 4, 7},
           {1, 0, 8},
           {2, 1, 8},
           {3, 2, 8},
           {0, 3, 8}}};
}

/// A thin wedge along x: two faces a degree apart.
TriangleMesh knife() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0.01}, {1, 1, 0.01}, {0, 1, -0.01}, {1, 1, -0.01}},
          {{0, 1, 3}, {0, 3, 2}, {1, 0, 4}, {1, 4, 5}, {2, 3, 5}, {2, 5, 4}, {0, 2, 4}, {1, 5, 3}}};
}

TEST(Pseudonormals, RightSideOfClosedMeshes) {
  EXPECT_EQ(wrong_share(shapes::box(1)), 0);
  EXPECT_EQ(wrong_share(shapes::box(3)), 0);
  EXPECT_EQ(wrong_share(shapes::torus(12, 0.05)), 0);
  EXPECT_EQ(wrong_share(knife()), 0);
  EXPECT_EQ(wrong_share(leaning_spike()), 0);
}

TEST(Pseudonormals, RightWhereBarycentricInterpolationOfVertexNormalsIsWrong) {
  const TriangleMesh mesh = leaning_spike();
  const Pseudonormals normals(mesh);
  constexpr std::uint32_t kOverhang = 7;
  const dvec3 weights(0.45, 0.45, 0.1);  // near the foot, where the normals of the corners are those of the plain
  const glm::uvec3 t = mesh.triangles[kOverhang];
  const dvec3 a = mesh.vertices[t.x], b = mesh.vertices[t.y], c = mesh.vertices[t.z];
  const dvec3 q = weights.x * a + weights.y * b + weights.z * c;
  const dvec3 p = q + 0.05 * glm::normalize(glm::cross(b - a, c - a));
  ASSERT_NEAR(Hierarchy(mesh).nearest(p).distance, 0.05, 1e-12);
  ASSERT_LT(winding_number(mesh, p), 0.5) << "p is outside";
  dvec3 interpolated(0);
  for (int k = 0; k < 3; ++k) {
    dvec3 corner(0);
    corner[k] = 1;
    interpolated += weights[k] * glm::normalize(normals.at(kOverhang, corner));
  }
  EXPECT_LT(glm::dot(p - q, interpolated), 0) << "interpolation takes p for inside";
  EXPECT_GT(glm::dot(p - q, normals.at(kOverhang, weights)), 0);
}

TEST(Pseudonormals, OfVerticesEdgesAndFaces) {
  const TriangleMesh box = shapes::box(1);
  const Pseudonormals normals(box);
  for (std::uint32_t i = 0; i < box.triangles.size(); ++i) {
    const auto corner = [&](int k) { return box.vertices[box.triangles[i][k]]; };
    const dvec3 face = normals.at(i, dvec3(1.0 / 3));
    EXPECT_NEAR(glm::distance(face, glm::normalize(glm::cross(corner(1) - corner(0), corner(2) - corner(0)))), 0,
                1e-15);
    for (int k = 0; k < 3; ++k) {
      dvec3 weights(0);
      weights[k] = 1;
      const dvec3 outwards = glm::normalize(corner(k) - dvec3(0.5));
      EXPECT_NEAR(glm::distance(glm::normalize(normals.at(i, weights)), outwards), 0, 1e-12)
          << "independent of how the squares are triangulated";
      weights[k] = weights[(k + 1) % 3] = 0.5;
      const dvec3 middle = (corner(k) + corner((k + 1) % 3)) * 0.5 - dvec3(0.5);
      EXPECT_NEAR(glm::distance(glm::normalize(normals.at(i, weights)), glm::normalize(middle)), 0, 1e-12);
    }
  }
}

TEST(Pseudonormals, SoupsAreWelded) {
  EXPECT_EQ(wrong_share(shapes::soup(shapes::box(2)), shapes::box(2)), 0);
  EXPECT_EQ(wrong_share(shapes::soup(knife()), knife()), 0);
}

TEST(Pseudonormals, FlatFacesTakeTheNormalsAroundThem) {
  // The blade of the knife in two rows of triangles without area; each point of it is nearest to one of those.
  TriangleMesh mesh{
      {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}, {0.25, 0, 0}, {0, 1, 0.01}, {1, 1, 0.01}, {0, 1, -0.01}, {1, 1, -0.01}},
      {{0, 2, 1},
       {0, 3, 2},
       {0, 1, 5},
       {0, 5, 4},
       {4, 5, 7},
       {4, 7, 6},
       {0, 4, 6},
       {1, 7, 5},
       {3, 0, 6},
       {2, 3, 6},
       {1, 2, 7},
       {2, 6, 7}}};
  EXPECT_EQ(wrong_share(mesh, knife()), 0);
  // And one whose corners are at two positions only.
  mesh = shapes::joined({{{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}, {{0, 1, 2}}}, knife());
  EXPECT_EQ(wrong_share(mesh, knife()), 0);
  const Pseudonormals nothing({{{0, 0, 0}, {1, 0, 0}}, {{0, 1, 0}, {0, 0, 0}}});
  for (std::uint32_t i = 0; i < 2; ++i) {
    for (const dvec3& weights : {dvec3(1, 0, 0), dvec3(0.5, 0.5, 0), dvec3(0.5, 0, 0.5), dvec3(1.0 / 3)}) {
      EXPECT_EQ(nothing.at(i, weights), dvec3(0));
    }
  }
}

TEST(Pseudonormals, TellClosedMeshesFromOthers) {
  for (const TriangleMesh& mesh : {shapes::box(2), shapes::torus(8), shapes::soup(shapes::torus(8)), knife()}) {
    EXPECT_TRUE(Pseudonormals(mesh).closed() && is_closed(mesh));
    TriangleMesh other = mesh;
    std::swap(other.triangles[0].x, other.triangles[0].y);
    EXPECT_FALSE(Pseudonormals(other).closed() || is_closed(other)) << "one face turned over";
    other.triangles.erase(other.triangles.begin());
    EXPECT_FALSE(Pseudonormals(other).closed() || is_closed(other)) << "one face missing";
    EXPECT_FALSE(Pseudonormals(shapes::joined(mesh, mesh)).closed()) << "four faces at every edge";
  }
  EXPECT_FALSE(Pseudonormals(shapes::grid(2)).closed());
}

TEST(Pseudonormals, AnOpenBoundaryIsExtrudedAlongItsFaces) {
  const TriangleMesh plate = shapes::grid(2);
  for (const double x : {-0.7, -0.01, 0.3, 1.2}) {
    for (const double y : {-0.3, 0.5, 1.6}) {
      EXPECT_TRUE(inside(plate, {x, y, -0.05}));
      EXPECT_FALSE(inside(plate, {x, y, 0.05}));
      EXPECT_FALSE(inside(plate, {x, y, 0}));
    }
  }
}

TEST(Pseudonormals, NonManifoldAndContradictingFaces) {
  // Two boxes that share an edge: four faces there, all facing outwards.
  TriangleMesh other = shapes::box(1);
  for (dvec3& p : other.vertices) p += dvec3(1, 1, 0);
  const TriangleMesh boxes = shapes::joined(shapes::box(1), other);
  EXPECT_FALSE(inside(boxes, {1.1, 0.9, 0.5}));
  EXPECT_TRUE(inside(boxes, {0.8, 0.9, 0.5}));
  // A face and its turned copy: on neither side is there an inside.
  const TriangleMesh sheet{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  for (const double z : {-0.1, 0.1}) EXPECT_FALSE(inside(sheet, {-0.2, 0.3, z}));
}

}  // namespace
