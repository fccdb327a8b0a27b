// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/picture_field.h"

#include <algorithm>

#include "field/scatter.h"
#include "field/signs.h"
#include "gl/context.h"

namespace tolvol {
namespace {

int longest(const glm::ivec3& v) { return std::max({v.x, v.y, v.z}); }

}  // namespace

PictureField::PictureField(const TriangleMesh& reference, bool mirrored, double tolerance, unsigned threads,
                           Progress* progress)
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
  std::vector<float> distances = signed_distance(reference, grid_, threads);
  grid_.distance = {};
  grid_.triangle = {};
  const float to_spacings = static_cast<float>((mirrored ? -1 : 1) / grid_.spacing);
  for (float& d : distances) d *= to_spacings;
  gl::run([&] { texture_.emplace(grid_, distances, tolerance, TextureFormat::float32); });
}

}  // namespace tolvol
