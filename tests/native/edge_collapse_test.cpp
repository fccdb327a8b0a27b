// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/edge_collapse.h"

#include <gtest/gtest.h>

#include "base/parallel.h"
#include "certified_mesh.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

TEST(EdgeCollapse, QuadricsAreTheSameOnThreads) {
  const TriangleMesh mesh = shapes::torus(30, 0.1);
  CertifiedMesh c(mesh, mesh.vertices, 0.1);
  Team one(1), three(3);
  const EdgeCollapse alone(*c.mesh, one), shared(*c.mesh, three);
  shapes::Random random(2);
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    const dvec3 p = random.point();
    ASSERT_EQ(shared.quadric(v)(p), alone.quadric(v)(p));
    ASSERT_GT(alone.quadric(v)(p), 0);
  }
}

// In a plate the faces hold a vertex along z alone, and each boundary edge holds both its ends across itself.
TEST(EdgeCollapse, BoundaryEdgesHoldBothTheirEnds) {
  const unsigned n = 6;
  const TriangleMesh plate = shapes::grid(n);
  CertifiedMesh c(plate, plate.vertices, 0.1);
  Team three(3);
  const EdgeCollapse collapse(*c.mesh, three);
  int corners = 0, sides = 0;
  for (std::uint32_t v = 0; v < plate.vertices.size(); ++v) {
    const dvec3& p = plate.vertices[v];
    const dvec3 at = c.mesh->position(v);
    const double step = 0.01;
    const bool along_x = p.x == 0 || p.x == 1, along_y = p.y == 0 || p.y == 1;
    const Quadric& quadric = collapse.quadric(v);
    EXPECT_EQ(quadric(at + dvec3(step, 0, 0)) > 1e-12, along_x) << p.x << " " << p.y;
    EXPECT_EQ(quadric(at + dvec3(0, step, 0)) > 1e-12, along_y) << p.x << " " << p.y;
    EXPECT_GT(quadric(at + dvec3(0, 0, step)), 1e-12);
    corners += along_x && along_y, sides += along_x != along_y;
  }
  EXPECT_EQ(corners, 4);
  EXPECT_EQ(sides, 4 * int(n - 1));
}

}  // namespace
