// SPDX-License-Identifier: GPL-3.0-or-later
/// The signed distances from which pictures are drawn, as a 3D texture [Botsch04, §3]. No check uses them.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <optional>

#include "base/progress.h"
#include "field/distance_texture.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class PictureField {
 public:
  /// The picture's field has this many grid nodes per tolerance, if GL and the memory budget of grids allow that many.
  static constexpr double kPrecision = 4;

  /// The arguments and the cost are those of DisplayGrid. A cell whose distances contradict their signs is shown
  /// unsigned, so that open, misoriented and intersecting references have no places that only seem near. A picture
  /// differs from the distance by at most (sqrt(3)/2) / precision() of the tolerance, and by far less where the
  /// reference is smooth. Must not be called on the GL thread. Throws GlUnavailable.
  PictureField(const TriangleMesh& reference, bool mirrored, double tolerance, unsigned threads = 0,
               Progress* progress = nullptr);

  const gl::Texture& texture() const { return texture_->texture(); }  ///< has units of spacing()
  const Box& box() const { return box_; }                             ///< is the box of the reference
  const glm::dvec3& origin() const { return grid_.origin; }
  double spacing() const { return grid_.spacing; }
  const glm::ivec3& nodes() const { return grid_.nodes; }
  double tolerance() const { return tolerance_; }
  double precision() const { return tolerance_ / grid_.spacing; }

  /// Maps a place from the frame to the nodes.
  glm::vec3 node(const glm::dvec3& p) const { return glm::vec3((p - grid_.origin) / grid_.spacing); }
  /// Maps a place from the nodes to the frame.
  glm::dmat4 to_frame() const {
    return glm::scale(glm::translate(glm::dmat4(1), grid_.origin), glm::dvec3(grid_.spacing));
  }

 private:
  double tolerance_;
  Box box_;
  DistanceGrid grid_;  // has no values
  std::optional<DistanceTexture> texture_;
};

}  // namespace tolvol
