// SPDX-License-Identifier: GPL-3.0-or-later
/// Pictures of a tolerance volume, ray-cast, with a mesh inside [Botsch04, Fig. 1].
#pragma once

#include <optional>

#include "geometry/hierarchy.h"
#include "picture/camera.h"
#include "picture/canvas.h"
#include "picture/drawn_mesh.h"
#include "picture/picture_field.h"

namespace tolvol {

class VolumeRenderer {
 public:
  /// Away with the volume on the side that `normal` points to; world.
  struct Cut {
    glm::dvec3 point, normal;
  };
  struct Options {
    std::optional<Cut> cut;
    Resolution resolution;
    Progress* progress = nullptr;
  };

  /// `hierarchy` of the reference, in its frame; used here alone. Keeps a reference to `field`. Not on the GL thread.
  /// Throws GlUnavailable. About 50 ms.
  VolumeRenderer(const PictureField& field, const Hierarchy& hierarchy, unsigned threads = 0);

  /// Throws InvalidInput for a cut that is no plane, and like Canvas::draw(); GlUnavailable. Seconds without a GPU.
  Image render(const DrawnMesh& mesh, const Camera& camera, const Frame& frame, const Options& options);

 private:
  const PictureField* field_;
  double far_spacing_ = 0;  // in nodes
  Canvas canvas_;
  MeshBuffers mesh_;
  gl::VertexArray no_vertices_;
  gl::Program depth_, surface_, backdrop_;
  gl::Texture far_, transfer_;
};

}  // namespace tolvol
