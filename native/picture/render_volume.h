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
  /// The volume is cut away on the side to which `normal` points. The plane is in the world.
  struct Cut {
    glm::dvec3 point, normal;
  };
  struct Options {
    std::optional<Cut> cut = std::nullopt;
    Resolution resolution = {};
    Progress* progress = nullptr;
  };

  /// `hierarchy` is of the reference in its frame, and is only used here. Keeps a reference to `field`. Must not be
  /// called on the GL thread. Throws GlUnavailable. Takes about 50 ms.
  VolumeRenderer(const PictureField& field, const Hierarchy& hierarchy, unsigned threads = 0);

  /// Throws InvalidInput for a cut that is no plane, throws like Canvas::draw(), and throws GlUnavailable. A picture
  /// takes seconds without a GPU.
  Image render(const DrawnMesh& mesh, const Camera& camera, const Frame& frame, const Options& options);

 private:
  const PictureField* field_;
  double far_spacing_ = 0;  // The spacing of the field far from the surface, in spacings of `field_`.
  Canvas canvas_;
  MeshBuffers mesh_;
  gl::VertexArray no_vertices_;
  gl::Program depth_, surface_, backdrop_;
  gl::Texture far_, transfer_;
};

}  // namespace tolvol
