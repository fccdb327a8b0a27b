// SPDX-License-Identifier: GPL-3.0-or-later
/// What is asked about each face that may close a hole, and about each of its edges, whatever the faces beside it.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

#include "base/call.h"
#include "base/parallel.h"
#include "check/certificate.h"
#include "check/facing.h"
#include "check/tolerance_volume.h"
#include "geometry/frame.h"
#include "repair/loop_outcome.h"
#include "topology/faces_cross.h"
#include "topology/near_faces.h"
#include "topology/sides.h"

namespace tolvol {

/// A hole: the boundary loop around it, and the triangles that fill it.
struct Hole {
  std::uint32_t number = 0;                             ///< its place among the loops
  std::vector<Side> sides;                              ///< of the rim
  std::vector<std::uint32_t> corner;                    ///< the vertex at which each side begins
  std::vector<glm::dvec3> at;                           ///< its position in the frame
  std::vector<TriangleCertificate::PointBound> bounds;  ///< of the positions
  bool reversed = false;                                ///< tells whether the rim looks against the reference
  std::size_t most_steps = 0;                           ///< after so many steps of proofs the hole is given up
  std::vector<glm::uvec3> faces;  ///< corners i < k < j of the loop, the front of which is (j, k, i)

  /// Calls visit(i, j) for the edges of the filling that are none of the rim, once each.
  template <class Visit>
  void for_each_inner_edge(Visit&& visit) const {
    const auto last = static_cast<std::uint32_t>(corner.size() - 1);
    for (const glm::uvec3& f : faces) {
      if (f.x != 0 || f.z != last) visit(f.x, f.z);  // each inner edge is (x, z) of the one face that it spans
    }
  }
};

/// Any number of threads may ask at the same time.
class FillingRules {
 public:
  /// `place` names for each vertex of the mesh the first one at its position. `space` is in the frame of the volume,
  /// and `shares` and `max_normal_angle` are those of CloseHolesOptions. Adds warnings. Keeps references to the mesh,
  /// the shares and the volume. O(m log m).
  FillingRules(const MeshView& mesh, std::vector<std::uint32_t> place, std::span<const Hole> holes,
               const StoredSpace& space, const ToleranceVolume& volume, std::span<const double> shares,
               double max_normal_angle, Team& team, std::vector<std::string>& warnings);

  /// Finds the bounds of a hole's corners, and whether the hole is reversed. This is needed before faces are asked
  /// about.
  void measure(Hole& hole) const;

  /// Returns what refuses an edge between two corners of a hole, if something does. A point that is outside refuses all
  /// triangles at the edge.
  std::optional<LoopOutcome> refusal_of_edge(const Hole& hole, std::uint32_t i, std::uint32_t j) const;
  /// The same for a face between three corners; that it may cross others is not asked here. Adds the steps of the
  /// search for a proof to `steps`.
  std::optional<LoopOutcome> refusal_of_face(const Hole& hole, const glm::uvec3& face, std::size_t& steps) const;

  /// The corners of a face as they are stored.
  Corners corners_of(const Hole& hole, const glm::uvec3& face) const {
    return {mesh_.vertices[hole.corner[face.z]], mesh_.vertices[hole.corner[face.y]],
            mesh_.vertices[hole.corner[face.x]]};
  }
  /// A key that is the same for all edges between the places of two corners.
  std::uint64_t edge_of(const Hole& hole, std::uint32_t i, std::uint32_t j) const {
    return pair_key(place_[hole.corner[i]], place_[hole.corner[j]]);
  }
  /// Calls visit(corners) for all faces of the mesh that a triangle crosses, and for some others whose boxes meet its
  /// box. A visit that returns false is the last one.
  template <class Visit>
  void for_each_near(const Corners& stored, Visit&& visit) const {
    std::size_t met = 0;
    faces_.for_each_near(stored, [&](std::uint32_t face) {
      if (++met % 64 == 0) poll();
      return visit(mesh_.corners(face));
    });
  }

 private:
  std::uint32_t vertex_of(Side corner) const { return mesh_.triangles[corner / 3][static_cast<int>(corner % 3)]; }
  double share_at(const Hole& hole, std::uint32_t corner) const {
    return shares_.empty() ? 1 : shares_[hole.corner[corner]];
  }
  void gather_faces(Team& team);
  void gather_edges(std::span<const Hole> holes);
  bool looks_against(const Hole& hole) const;

  MeshView mesh_;
  std::vector<std::uint32_t> place_;
  StoredSpace space_;
  const ToleranceVolume& volume_;
  std::span<const double> shares_;
  std::optional<TriangleCertificate> certificate_;
  std::optional<FacingRule> facing_;
  NearFaces faces_;                          ///< of the mesh
  std::unordered_set<std::uint64_t> edges_;  ///< between places at rims
};

}  // namespace tolvol
