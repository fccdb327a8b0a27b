// SPDX-License-Identifier: GPL-3.0-or-later
/// Pictures of a mesh coloured by its distance to the reference at every pixel [Botsch04, §3, Fig. 2].
#pragma once

#include <optional>

#include "picture/camera.h"
#include "picture/canvas.h"
#include "picture/drawn_mesh.h"
#include "picture/picture_field.h"

namespace tolvol {

class DistanceRenderer {
 public:
  struct Options {
    Transfer transfer = Transfer::signed_distance;
    bool edges = false;  ///< says whether to draw the mesh's edges as well
    Resolution resolution = {};
    Progress* progress = nullptr;
  };

  /// Keeps a reference to `field`, which must outlive this. Must not be called on the GL thread. Throws GlUnavailable.
  explicit DistanceRenderer(const PictureField& field);

  /// The light is at the eye, so that a place that faces the eye has exactly the transfer function's colour. Places
  /// farther than the tolerance are striped. Throws like Canvas::draw(), and GlUnavailable. O(triangles + samples).
  Image render(const DrawnMesh& mesh, const Camera& camera, const Frame& frame, const Options& options);

 private:
  const PictureField* field_;
  Canvas canvas_;
  MeshBuffers mesh_;
  gl::Program faces_, edges_;
  gl::Texture signed_, magnitude_;
};

}  // namespace tolvol
