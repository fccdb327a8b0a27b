// SPDX-License-Identifier: GPL-3.0-or-later
/// A distance grid as a GL 3D texture [Botsch04, §3]. Its size need not be a power of two.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "field/distance_grid.h"
#include "gl/objects.h"

namespace tolvol {

/// Normalised formats hold the range [-limit, limit]. A distance beyond it takes the nearer end.
enum class TextureFormat { normalised8, normalised16, float32 };

class DistanceTexture {
 public:
  /// `distance` has one value for each node, in the grid's order and pitch, signed or not; usually it is grid.distance.
  /// Must be called on the GL thread. Throws ResourceLimit, naming a precision that fits, if the grid is larger than
  /// GL_MAX_3D_TEXTURE_SIZE along an axis, and GlUnavailable, also if the driver is out of memory.
  DistanceTexture(const DistanceGrid& grid, std::span<const float> distance, double limit, TextureFormat format);

  const gl::Texture& texture() const { return texture_; }
  void filter_linearly() { texture_.filter_linearly(); }
  /// A texel stands for the distance `scale` * its value + `offset`, in frame lengths. For float32 these are 1 and 0.
  float scale() const { return scale_; }
  float offset() const { return offset_; }
  /// The largest difference between a texel and a node's distance within the limit.
  double quantisation() const { return quantisation_; }

 private:
  gl::Texture texture_;
  float scale_ = 1, offset_ = 0;
  double quantisation_ = 0;
};

/// The texture coordinate of a position is (p - origin) * scale + offset, component by component. GL has values at the
/// centres of texels and the grid has them at the nodes, so that node i is at (i + 1/2) / nodes.
struct TextureCoordinates {
  glm::dvec3 scale, offset;
  explicit TextureCoordinates(const DistanceGrid& grid)
      : scale(1.0 / (grid.spacing * glm::dvec3(grid.nodes))), offset(0.5 / glm::dvec3(grid.nodes)) {}
};

}  // namespace tolvol
