// SPDX-License-Identifier: GPL-3.0-or-later
/// The side of a closed surface that a point is on.
#pragma once

#include <glm/glm.hpp>

#include "geometry/hierarchy.h"
#include "geometry/pseudonormals.h"
#include "geometry/triangle_mesh.h"
#include "measure/placed_pair.h"

namespace tolvol {

/// Tells whether a mesh in the frame is a point within rounding, as it is if the other one has corners very far away.
bool is_a_point(const TriangleMesh& mesh);

/// Tells inside from outside of a closed mesh. Nothing is inside of an open mesh. The normals are those of the part
/// that the distances are measured from. Its cuts are never nearest, and everywhere else it has the faces of the whole
/// mesh.
class SideOf {
 public:
  /// `world_b` is the mesh that pair.b is a part of. About 1 us a triangle of it.
  SideOf(const PlacedPair& pair, const TriangleMesh& world_b);

  bool known() const { return known_; }
  bool inside(const glm::dvec3& p, const Hierarchy::Nearest& nearest) const {
    return known() && !point_ &&
           turn_ * glm::dot(p - nearest.point, normals_.at(nearest.triangle, nearest.weights)) < 0;
  }

 private:
  Pseudonormals normals_;
  bool known_;
  bool point_;  // tells whether b has no inside beyond rounding
  double turn_;
};

}  // namespace tolvol
