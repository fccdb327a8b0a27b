// SPDX-License-Identifier: GPL-3.0-or-later
/// From where a picture is taken.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// In world units; perspective. `angle` is the height of the picture in degrees.
struct Camera {
  glm::dvec3 eye{0, -1, 0}, target{0}, up{0, 0, 1};
  double angle = 30;
};

/// Throws InvalidInput unless everything is finite, the eye is away from the target, `up` is not along the view and the
/// angle is between 0 and 180 degrees, without either.
void validate(const Camera& camera);

/// How framing() looks.
struct Framing {
  glm::dvec3 direction{0.55, -1,
                       0.4};  ///< from the mesh to the eye; the front, right and above of a model of Blender's
  glm::dvec3 up{0, 0, 1};
  double angle = 30;  ///< the height of the picture in degrees
  double aspect = 1;  ///< its width over its height
  double margin = 0;  ///< kept free around the mesh, world units
};

/// The camera that sees all used vertices of a mesh as large as the picture can show them. Throws InvalidInput like
/// validate() does. O(n).
Camera framing(std::span<const glm::dvec3> world, std::span<const glm::uvec3> triangles, const Framing& how);

/// A camera as the shaders take it.
struct View {
  glm::dvec3 eye, forward, right, above;  ///< in the frame; right and above span half of the picture at distance 1
  glm::dmat4 to_clip;

  /// Clip planes are put around `box` (in the frame); where all of it is behind the eye nothing will be seen.
  View(const Camera& camera, const Frame& frame, double aspect, const Box& box);
};

}  // namespace tolvol
