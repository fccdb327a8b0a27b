// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/drawn_mesh.h"

#include <algorithm>
#include <limits>

#include "base/call.h"
#include "base/errors.h"

namespace tolvol {
namespace {

constexpr GLsizei kDrawnAtOnce = 3 << 15;  // This many corners are drawn between two polls.
// A mesh is refused if a vertex is farther than this from the grid's origin, in spacings of its nodes, because products
// of float32 matrices would overflow before clipping.
constexpr double kReach = 1e9;

/// Leaves room for a mesh of about the same size, so that a mesh that changes every frame is not allotted anew.
void write_into(gl::Buffer& buffer, std::size_t bytes, const void* data) {
  if (buffer.bytes() < bytes || buffer.bytes() / 2 > bytes) buffer = gl::Buffer(bytes, nullptr);
  buffer.write(0, bytes, data);
}

}  // namespace

DrawnMesh::DrawnMesh(std::span<const glm::dvec3> stored, std::span<const glm::uvec3> t, const StoredSpace& space,
                     const PictureField& field)
    : triangles(t) {
  validate(stored, t);
  if (t.size() > std::numeric_limits<GLsizei>::max() / 3) throw InvalidInput("too many triangles for one picture");
  const std::vector<bool> used = used_vertices(stored.size(), t);
  nodes.resize(stored.size());
  for (std::size_t i = 0; i < stored.size(); ++i) {
    poll_at(i);
    if (!used[i]) continue;
    const glm::dvec3 p = space.frame(stored[i]);
    nodes[i] = field.node(p);
    if (!(glm::dot(nodes[i], nodes[i]) < kReach * kReach)) {
      throw InvalidInput("vertex " + std::to_string(i) + " is too far from the reference to be drawn", "too_far");
    }
    box.add(p);
  }
}

void MeshBuffers::write(const DrawnMesh& mesh) {
  count_ = static_cast<GLsizei>(3 * mesh.triangles.size());
  write_into(vertices_, mesh.nodes.size() * sizeof(glm::vec3), mesh.nodes.data());
  write_into(indices_, mesh.triangles.size() * sizeof(glm::uvec3), mesh.triangles.data());
  array_ = gl::VertexArray::make();
  array_.bind();
  glBindVertexBuffer(0, vertices_.name(), 0, sizeof(glm::vec3));
  glVertexAttribFormat(0, 3, GL_FLOAT, GL_FALSE, 0);
  glVertexAttribBinding(0, 0);
  glEnableVertexAttribArray(0);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
}

void MeshBuffers::draw() const {
  array_.bind();
  // The mesh is not drawn at once, because without a GPU the edges of a million triangles take a second.
  for (GLsizei first = 0; first < count_; first += kDrawnAtOnce) {
    poll();
    const std::size_t offset = static_cast<std::size_t>(first) * sizeof(GLuint);
    // GL takes an offset into a buffer as a pointer.
    const void* const start = reinterpret_cast<const void*>(offset);  // NOLINT(performance-no-int-to-ptr)
    glDrawElements(GL_TRIANGLES, std::min(kDrawnAtOnce, count_ - first), GL_UNSIGNED_INT, start);
    if (count_ > kDrawnAtOnce) glFinish();
  }
}

}  // namespace tolvol
