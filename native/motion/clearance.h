// SPDX-License-Identifier: GPL-3.0-or-later
/// How far the vertices of a triangle mesh may go before any two faces could cross: most steps of a smoothing are so
/// short that nothing has to be looked at.
///
/// Each vertex has an anchor and a room around it. Two faces whose corners are all in their rooms do not cross, and
/// such a face is not degenerate, unless it was so at the anchors and none of its corners has any room. There are two
/// reasons. (1) The faces have no vertex in common, and at the anchors they are farther apart than their rooms together
/// reach. (2) They have one in common, and the faces around it, seen at the anchors along an axis of the coordinates,
/// are a fan that does not overlap. A fan stays one while no triangle of it becomes degenerate in that view, and before
/// that a corner would have to go half as far as the triangle is wide.
#pragma once

#include <atomic>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "motion/moving_faces.h"
#include "motion/moving_mesh.h"
#include "topology/faces_cross.h"

namespace tolvol {

class Clearance {
 public:
  /// Keeps a reference to the mesh, which must be of triangles and is only asked for what lies around what. The stored
  /// positions are the anchors, but there is no room until renew() finds one for all vertices.
  Clearance(MovingMesh& mesh, std::span<const glm::dvec3> stored);

  /// Whether the vertex is in its room there.
  bool has(std::uint32_t vertex, const glm::dvec3& stored) const {
    const glm::dvec3 way = stored - anchor_[vertex];
    return glm::dot(way, way) <= room_[vertex] * room_[vertex];
  }

  /// Finds new anchors and rooms for the vertices that are not in their rooms where they are stored; other rooms may
  /// become smaller. A vertex that left a room at once gets none for the next calls. `near` must have boxes around
  /// all faces and their rooms; faces that have no corner without room get such a box. Throws Cancelled, after which
  /// some vertices are in no room. About 1.5 us a face.
  void renew(std::span<const glm::dvec3> stored, MovingFaces& near);

  /// Whether a corner of the face has no room, wherever it is.
  bool rests(std::uint32_t face) const;

  /// A box around a vertex wherever it is in its room, as MovingFaces asks for it.
  auto in_room() const {
    return [this](std::uint32_t vertex) { return room_box(vertex); };
  }

 private:
  Box room_box(std::uint32_t vertex) const;
  double fan(std::uint32_t vertex) const;
  double reach(std::uint32_t face) const;
  Corners corners(std::uint32_t face) const;
  void limit_by_fans(std::span<const std::uint32_t> vertices);
  void limit_by_gaps(std::span<const std::uint32_t> faces, const MovingFaces& near);
  std::vector<std::uint32_t> gone(std::span<const glm::dvec3> stored);

  MovingMesh& mesh_;
  std::vector<glm::dvec3> anchor_;
  std::vector<double> room_;
  std::vector<double> reach_;                   // This is room_, or the most that renew() will make of it.
  std::vector<std::atomic<double>> face_room_;  // Scratch: what a face leaves to its corners, infinite between calls.
  std::vector<std::uint32_t> renewed_;          // For each face: the last call of renew() for one of its corners.
  std::vector<std::uint32_t> since_;            // For each vertex: the last call of renew() for it.
  std::vector<std::uint8_t> rest_;              // For each vertex: in how many calls it will get no room.
  std::uint32_t now_ = 0;                       // The number of these calls.
};

}  // namespace tolvol
