// SPDX-License-Identifier: GPL-3.0-or-later
/// A mesh as GL draws it, in the coordinates of a field's nodes, in float32.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "geometry/frame.h"
#include "gl/objects.h"
#include "picture/picture_field.h"

namespace tolvol {

struct DrawnMesh {
  std::vector<glm::vec3> nodes;  ///< has the place of each vertex among the nodes
  std::span<const glm::uvec3> triangles;
  Box box;  ///< is the box of the used vertices, in the frame

  /// `space` leads to the field's frame. `triangles` must outlive this. Throws InvalidInput, naming the first offender,
  /// for a bad mesh and for a mesh so far from the reference that float32 cannot draw it.
  DrawnMesh(std::span<const glm::dvec3> stored, std::span<const glm::uvec3> triangles, const StoredSpace& space,
            const PictureField& field);
};

/// The memory of a mesh on the GPU, which is kept from one mesh to the next. Must be used on the GL thread.
class MeshBuffers {
 public:
  void write(const DrawnMesh& mesh);
  /// Draws with the vertices as attribute 0.
  void draw() const;

 private:
  gl::VertexArray array_;
  gl::Buffer vertices_, indices_;
  GLsizei count_ = 0;
};

}  // namespace tolvol
