// SPDX-License-Identifier: GPL-3.0-or-later
// This follows [Botsch04, §3], except that sizes need not be powers of two and that there are float and 16-bit formats.
#include "field/distance_texture.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

#include "base/errors.h"

namespace tolvol {
namespace {

void require_size(const DistanceGrid& grid, double limit) {
  const int largest = gl::Texture::largest_3d(), nodes = std::max({grid.nodes.x, grid.nodes.y, grid.nodes.z});
  if (nodes <= largest) return;
  // The number of nodes is proportional to the precision, except for the few of the band.
  const double precision = limit / grid.spacing * largest / nodes;
  std::ostringstream text;
  text.precision(2);
  text << "a distance texture of " << grid.nodes.x << " x " << grid.nodes.y << " x " << grid.nodes.z
       << " texels is larger than this GL allows (" << largest << "); precision " << 0.99 * precision << " fits";
  throw ResourceLimit(text.str());
}

/// Maps [-limit, limit] to unsigned integers.
template <class T>
std::vector<T> normalise(std::span<const float> distance, double limit) {
  constexpr double kLargest = std::numeric_limits<T>::max();
  std::vector<T> result(distance.size());
  std::transform(distance.begin(), distance.end(), result.begin(), [&](float d) {
    return static_cast<T>(std::lround(kLargest * std::clamp(0.5 + 0.5 * static_cast<double>(d) / limit, 0.0, 1.0)));
  });
  return result;
}

}  // namespace

DistanceTexture::DistanceTexture(const DistanceGrid& grid, std::span<const float> distance, double limit,
                                 TextureFormat format) {
  require_size(grid, limit);
  if (format == TextureFormat::float32) {
    texture_ = gl::Texture(GL_TEXTURE_3D, GL_R32F, grid.nodes, GL_RED, GL_FLOAT, distance.data(), grid.pitch);
    return;
  }
  scale_ = static_cast<float>(2 * limit), offset_ = static_cast<float>(-limit);
  const bool bytes = format == TextureFormat::normalised8;
  quantisation_ = limit / (bytes ? 255 : 65535);
  if (bytes) {
    texture_ = gl::Texture(GL_TEXTURE_3D, GL_R8, grid.nodes, GL_RED, GL_UNSIGNED_BYTE,
                           normalise<std::uint8_t>(distance, limit).data(), grid.pitch);
  } else {
    texture_ = gl::Texture(GL_TEXTURE_3D, GL_R16, grid.nodes, GL_RED, GL_UNSIGNED_SHORT,
                           normalise<std::uint16_t>(distance, limit).data(), grid.pitch);
  }
}

}  // namespace tolvol
