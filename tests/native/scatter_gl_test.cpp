// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/scatter_gl.h"

#include <algorithm>
#include <cmath>

#include "base/call.h"
#include "check/tolerance_volume.h"
#include "decimation_cases.h"
#include "field/scatter.h"
#include "geometry/closest_point.h"
#include "gl_fixture.h"
#include "laid_out.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

using ScatterGl = GlTest;

/// float32 rounds coordinates and distances of about 1 by less than this.
constexpr double kRounding = 1e-6;

struct Fields {
  DistanceGrid cpu, gpu;
};

Fields fields_of(const TriangleMesh& mesh, double tolerance, double precision) {
  Fields fields{laid_out(mesh, tolerance, precision), laid_out(mesh, tolerance, precision)};
  scatter(mesh, fields.cpu, 1);
  scatter_gl(mesh, fields.gpu);
  return fields;
}

/// Expects the same distances, and other ids only where two triangles are equally near. Returns how many nodes have
/// one.
std::size_t expect_same(const TriangleMesh& mesh, const Fields& fields) {
  const auto& [cpu, gpu] = fields;
  std::size_t named = 0, others = 0;
  EXPECT_EQ(cpu.distance.size(), gpu.distance.size());
  for (std::size_t i = 0; i < cpu.distance.size(); ++i) {
    EXPECT_NEAR(cpu.distance[i], gpu.distance[i], kRounding);
    const bool at_band = std::max(cpu.distance[i], gpu.distance[i]) > cpu.band - kRounding;
    if (at_band) continue;
    ++named;
    others += cpu.triangle[i] != gpu.triangle[i];
    EXPECT_LT(gpu.triangle[i], mesh.triangles.size());
  }
  // Of the nodes that are nearest to an edge each has two nearest triangles, and rounding chooses.
  EXPECT_LT(static_cast<double>(others), 0.25 * static_cast<double>(named));
  return named;
}

TEST_F(ScatterGl, IsScatterOnEveryMesh) {
  std::size_t named = 0;
  for (const cases::Case& c : cases::all()) {
    const auto volume = c.volume();
    const double tolerance = std::max(0.01, volume->frame_tolerance());
    named += expect_same(volume->reference(), fields_of(volume->reference(), tolerance, 1));
  }
  EXPECT_GT(named, 100000u);
}

TEST_F(ScatterGl, NamesATriangleThatIsAsNear) {
  const TriangleMesh mesh = shapes::torus(20, 0.05);
  const auto [cpu, gpu] = fields_of(mesh, 0.1, 3);
  std::size_t others = 0;
  for (int z = 0; z < gpu.nodes.z; ++z) {
    for (int y = 0; y < gpu.nodes.y; ++y) {
      for (int x = 0; x < gpu.nodes.x; ++x) {
        const std::size_t i = gpu.index(x, y, z);
        if (cpu.triangle[i] == gpu.triangle[i] || gpu.triangle[i] == DistanceGrid::kNone) continue;
        ++others;
        const glm::uvec3 t = mesh.triangles[gpu.triangle[i]];
        const dvec3 node = gpu.origin + gpu.spacing * dvec3(x, y, z);
        const double d2 =
            closest_point(node, mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]).distance_squared;
        ASSERT_NEAR(std::sqrt(d2), cpu.distance[i], kRounding);
      }
    }
  }
  EXPECT_GT(others, 0u);
}

// The box of one triangle across the whole grid holds nearly all nodes, and its band hardly any. The wide bands of the
// second grid are cut into blocks.
TEST_F(ScatterGl, LargeTrianglesNeedlesPointsAndWideBands) {
  TriangleMesh mesh;
  mesh.vertices = {{-1, -1, -1}, {1, 1, 1}, {1, -1, 0.5}, {-1, 1, 1}, {-0.999999, 1, 1}, {1, -1, -1}, {0.3, 0.2, 0.1}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}, {0, 1, 0}, {6, 6, 6}};
  const Fields fields = fields_of(mesh, 0.02, 1);
  EXPECT_GT(expect_same(mesh, fields), 10000u);
  EXPECT_GT(expect_same(mesh, fields_of(mesh, 0.5, 10)), 10000u);
}

TEST_F(ScatterGl, EndsOnRequest) {
  const TriangleMesh mesh = shapes::torus(100);
  DistanceGrid grid = laid_out(mesh, 0.02, 1);
  Progress progress;
  progress.cancel();
  const Call call(&progress);
  EXPECT_THROW(scatter_gl(mesh, grid, &progress), Cancelled);
}

}  // namespace
