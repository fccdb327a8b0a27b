// SPDX-License-Identifier: GPL-3.0-or-later
/// The signed distances that pictures are drawn from, as a 3D texture [Botsch04, §3]; never for a check.
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
  /// Grid nodes per tolerance, where GL and the memory budget of grids allow that many.
  static constexpr double kPrecision = 4;

  /// Arguments and cost as for DisplayGrid. A cell whose distances contradict their signs is shown unsigned, so that
  /// open, misoriented and intersecting references have no places that only seem near. What a picture shows differs
  /// from the distance by at most (sqrt(3)/2) / precision() of the tolerance, and by far less where the reference is
  /// smooth. Not on the GL thread. Throws GlUnavailable.
  PictureField(const TriangleMesh& reference, bool mirrored, double tolerance, unsigned threads = 0,
               Progress* progress = nullptr);

  const gl::Texture& texture() const { return texture_->texture(); }  ///< in units of spacing()
  const Box& box() const { return box_; }                             ///< of the reference
  const glm::dvec3& origin() const { return grid_.origin; }
  double spacing() const { return grid_.spacing; }
  const glm::ivec3& nodes() const { return grid_.nodes; }
  double tolerance() const { return tolerance_; }
  double precision() const { return tolerance_ / grid_.spacing; }

  /// Where a place of the frame is among the nodes.
  glm::vec3 node(const glm::dvec3& p) const { return glm::vec3((p - grid_.origin) / grid_.spacing); }
  /// From nodes to the frame.
  glm::dmat4 to_frame() const {
    return glm::scale(glm::translate(glm::dmat4(1), grid_.origin), glm::dvec3(grid_.spacing));
  }

 private:
  double tolerance_;
  Box box_;
  DistanceGrid grid_;  // without its values
  std::optional<DistanceTexture> texture_;
};

}  // namespace tolvol
