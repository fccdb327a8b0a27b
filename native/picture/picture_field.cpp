// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/picture_field.h"

#include "field/scatter.h"
#include "gl/context.h"
#include "reference/closest_point.h"
#include "reference/parallel.h"
#include "reference/pseudonormals.h"

namespace tolvol {
namespace {

int longest(const glm::ivec3& v) { return std::max({v.x, v.y, v.z}); }

/// In units of the spacing, negative inside the reference.
void sign_and_scale(const TriangleMesh& reference, DistanceGrid& grid, unsigned threads) {
  const Pseudonormals normals(reference);
  const double to_spacings = 1 / grid.spacing;
  parallel_for(static_cast<std::size_t>(grid.nodes.z), 1, threads, [&](std::size_t begin, std::size_t) {
    const int z = static_cast<int>(begin);
    for (int y = 0; y < grid.nodes.y; ++y) {
      for (int x = 0; x < grid.nodes.x; ++x) {
        const std::size_t i = grid.index(x, y, z);
        const double scaled = grid.distance[i] * to_spacings;
        grid.distance[i] = static_cast<float>(scaled);
        if (grid.triangle[i] == DistanceGrid::kNone) continue;
        const glm::uvec3& t = reference.triangles[grid.triangle[i]];
        const glm::dvec3 p = grid.origin + grid.spacing * glm::dvec3(x, y, z);
        const ClosestPoint q =
            closest_point(p, reference.vertices[t.x], reference.vertices[t.y], reference.vertices[t.z]);
        if (normals.inside(p, grid.triangle[i], q)) grid.distance[i] = static_cast<float>(-scaled);
      }
    }
  });
}

}  // namespace

PictureField::PictureField(const TriangleMesh& reference, double tolerance, unsigned threads, Progress* progress)
    : tolerance_(tolerance) {
  int largest = 0;
  gl::run([&] { largest = gl::Texture::largest_3d(); });
  const std::vector<bool> used = used_vertices(reference.vertices.size(), reference.triangles);
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) box_.add(reference.vertices[i]);
  }
  double precision = precision_that_fits(box_, tolerance, kPrecision);
  while (longest(layout_grid(box_, tolerance, precision).nodes) > largest) precision /= 2;
  grid_ = layout_grid(box_, tolerance, precision);
  scatter(reference, grid_, threads, progress);
  sign_and_scale(reference, grid_, threads);
  gl::run([&] { texture_.emplace(grid_, grid_.distance, tolerance, TextureFormat::float32); });
  grid_.distance = {};
  grid_.triangle = {};
}

}  // namespace tolvol
