// SPDX-License-Identifier: GPL-3.0-or-later
// A judge that shares nothing with this project: CGAL's Polygon_mesh_processing::bounded_error_Hausdorff_distance,
// which bisects triangles until its own bounds are closer than the error asked for.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/distance.h>
#include <CGAL/Surface_mesh.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "measure/hausdorff.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

Surface surface(const TriangleMesh& mesh) {
  Surface s;
  for (const dvec3& p : mesh.vertices) s.add_vertex({p.x, p.y, p.z});
  using Index = Surface::Vertex_index;
  for (const glm::uvec3& t : mesh.triangles)
    EXPECT_NE(s.add_face(Index(t.x), Index(t.y), Index(t.z)), Surface::null_face());
  return s;
}

/// A height field over n x n squares with random heights: rough, so that the largest distance can be anywhere.
TriangleMesh terrain(unsigned n, unsigned seed, double roughness) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-roughness, roughness);
  return shapes::squares(n, [&](const dvec3& p) {
    return dvec3(p.x, p.y, 0.1 * std::sin(6 * p.x) * std::cos(5 * p.y) + uniform(random));
  });
}

TEST(HausdorffCgal, AgreesWithinItsError) {
  const double error = 1e-7;
  for (const auto& [n, m, roughness] :
       {std::tuple{4u, 60u, 0.02}, {60u, 4u, 0.02}, {13u, 17u, 0.1}, {50u, 50u, 0.01}}) {
    const TriangleMesh a = terrain(n, 1, roughness), b = terrain(m, 2, roughness);
    const double judged = CGAL::Polygon_mesh_processing::bounded_error_Hausdorff_distance<CGAL::Sequential_tag>(
        surface(a), surface(b), error);
    const HausdorffInterval h = hausdorff(a, b);
    EXPECT_LE(h.lower, judged + error);
    EXPECT_GE(h.upper, judged - error);
  }
}

}  // namespace
