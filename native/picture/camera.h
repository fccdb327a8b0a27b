// SPDX-License-Identifier: GPL-3.0-or-later
/// The view of a picture.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// A perspective view in world units. `angle` is the height of the picture in degrees.
struct Camera {
  glm::dvec3 eye{0, -1, 0}, target{0}, up{0, 0, 1};
  double angle = 30;
};

/// Throws InvalidInput unless everything is finite, the eye is away from the target, `up` is not along the view and the
/// angle is between 0 and 180 degrees, without either.
void validate(const Camera& camera);

/// The options of framing().
struct Framing {
  glm::dvec3 direction{0.55, -1,
                       0.4};  ///< leads from the mesh to the eye, which is in front, right and above a Blender model
  glm::dvec3 up{0, 0, 1};
  double angle = 30;  ///< is the height of the picture in degrees
  double aspect = 1;  ///< is its width over its height
  double margin = 0;  ///< is kept free around the mesh, in world units
};

/// Returns the camera that sees all used vertices of a mesh, as large as the picture can show them. Throws InvalidInput
/// like validate(). O(n).
Camera framing(std::span<const glm::dvec3> world, std::span<const glm::uvec3> triangles, const Framing& how);

/// A camera in the form that the shaders take.
struct View {
  glm::dvec3 eye, forward, right, above;  ///< are in the frame; right and above span half of the picture at distance 1
  glm::dmat4 to_clip;

  /// The clip planes are around `box`, which is in the frame. If all of it is behind the eye, nothing is seen.
  View(const Camera& camera, const Frame& frame, double aspect, const Box& box);
};

}  // namespace tolvol
