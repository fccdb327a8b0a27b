// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/picture_field.h"

#include "base/call.h"
#include "field/display_grid.h"
#include "gl/context.h"

namespace tolvol {

PictureField::PictureField(const TriangleMesh& reference, bool mirrored, double tolerance, unsigned threads,
                           Progress* progress)
    : tolerance_(tolerance) {
  DisplayGrid::Options options{.precision = kPrecision, .threads = threads, .progress = progress};
  gl::run([&] { options.longest = gl::Texture::largest_3d(); });
  DisplayGrid display(reference, mirrored, tolerance, options);
  grid_ = std::move(display.grid);
  poll();
  for (const glm::uvec3& t : reference.triangles) {
    for (int k = 0; k < 3; ++k) box_.add(reference.vertices[t[k]]);
  }
  gl::run([&] { texture_.emplace(grid_, grid_.distance, tolerance, TextureFormat::float32); });
  grid_.distance = {};
  grid_.triangle = {};
}

}  // namespace tolvol
