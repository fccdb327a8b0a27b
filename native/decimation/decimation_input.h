// SPDX-License-Identifier: GPL-3.0-or-later
/// The input of a decimation, made ready: joined where it has T-junctions, cut to a manifold, in the volume's frame,
/// certified, with the vertices that must stay and the bounds that were asked for.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "check/certificate.h"
#include "check/coverage.h"
#include "check/facing.h"
#include "check/tolerance_volume.h"
#include "decimation/boundary.h"
#include "decimation/bounded_mesh.h"
#include "decimation/certified_bounds.h"
#include "decimation/decimation.h"
#include "topology/join_t_junctions.h"
#include "topology/manifold_cut.h"
#include "topology/new_crossings.h"

namespace tolvol {

class DecimationInput {
 public:
  /// Throws as decimate() does. Unless `joins_t_junctions`, T-junctions are pinned instead. Notes in `report` what it
  /// finds: locked vertices, faces outside, warnings and the method. Keeps references to all but the team. About 0.7 us
  /// a triangle, and the proof of each that has to be certified: all of them, or those after the reference's if the
  /// input has the vertices of the reference and begins with its triangles.
  DecimationInput(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
                  const ToleranceVolume* volume, const DecimationOptions& options, bool joins_t_junctions, Team& team,
                  DecimationResult& report);
  DecimationInput(const DecimationInput&) = delete;
  DecimationInput& operator=(const DecimationInput&) = delete;

  /// The bounds that the changes of the mesh must keep; null for none.
  Bounds* bounds() const { return bounds_; }
  /// The mesh to decimate, which may be taken once. Its store() refers to this object.
  BoundedMeshInput take_mesh();

  std::span<const glm::dvec3> vertices() const { return vertices_; }
  /// The triangles of the input. Those that were divided to join T-junctions have a piece in their place, and further
  /// pieces at the end.
  std::span<const glm::uvec3> triangles() const { return triangles_; }
  /// The triangle of the input that one of triangles() is, or is a piece of.
  std::uint32_t parent(std::uint32_t triangle) const { return joined_ ? joined_->parent[triangle] : triangle; }
  bool is_piece(std::uint32_t triangle) const { return joined_ && joined_->is_piece[triangle]; }
  /// The barycentric weights of the corners of one of triangles() in its parent, a column for each corner.
  glm::dmat3 weights_in_parent(std::uint32_t triangle) const;
  /// The number of places at which vertices were put into edges and triangles.
  std::size_t joined_count() const { return joined_ ? joined_->count : 0; }
  /// Its `mates` and `stand_in` are empty after take_mesh().
  const CutMesh& cut() const { return cut_; }
  /// The cut mesh, in the frame.
  TriangleMesh frame_mesh() const { return {frame_positions(), cut_.triangles}; }
  /// The cut mesh, with positions as they are stored; valid after take_mesh().
  MeshView stored_mesh() const { return {cut_.triangles, stored_}; }
  /// The corners, as they are stored, of the triangles that no manifold holds.
  std::vector<Corners> faces_aside() const;
  /// For each triangle of the cut mesh, the number of its island; valid after take_mesh(), empty without wedges.
  const std::vector<std::uint32_t>& islands() const { return islands_; }

  double max_normal_angle() const { return options_.max_normal_angle; }
  /// The rule of facing; null where no angle is kept.
  const FacingRule* facing() const { return facing_ ? &*facing_ : nullptr; }
  /// The triangles of the cut mesh that exceed the angle of the rule as they come.
  const std::vector<std::uint32_t>& exceeding() const { return exceeding_; }

  /// The volume, where the input is the reference itself; else null.
  const ToleranceVolume* own_volume() const {
    return own_count_ > 0 && own_count_ == triangles_.size() ? volume_ : nullptr;
  }
  /// How far positions in the frame may be from those that the stored ones stand for; 0 without a volume.
  double mapping_error() const { return mapping_error_; }
  /// For each of triangles(), its triangle in the cut mesh or CutMesh::kNone; empty unless the input has the vertices
  /// of the reference and begins with its triangles.
  const std::vector<std::uint32_t>& element_of() const { return element_of_; }

  /// Whether the input begins with the reference and some of its faces are not strictly inside the cell.
  bool is_reference_across_cell() const { return own_count_ > 0 && reaches_out_of_cell_; }
  /// The corner of triangles(), as 3 * triangle + corner, of a corner of the cut mesh.
  std::uint32_t input_corner(std::uint32_t triangle, int corner) const {
    return 3 * cut_.triangle_input[triangle] + static_cast<std::uint32_t>(own_corner(triangle, corner));
  }
  /// Which corner of its input triangle a corner of the cut mesh is. The other way around it is the same.
  int own_corner(std::uint32_t triangle, int corner) const {
    return cut_.reversed[triangle] && corner != 0 ? 3 - corner : corner;
  }

 private:
  Frame own_frame() const;
  std::vector<glm::dvec3> frame_positions() const;
  void pin();
  void hold_outside_cell();
  void hold_near(std::span<const Part> pieces, const TriangleMesh& elements, double provable);
  TriangleMesh stored_cut() const;
  std::vector<glm::uvec2> open_edges() const;
  bool join_t_junctions(bool may_divide, Team& team);
  bool may_join(const TJunction& junction) const;
  void label_joined_wedges();
  void pin_t_junctions(Team& team);
  template <class Visit>
  void for_holders(Visit&& visit) const;
  void pin(std::uint32_t vertex, const std::string& cause);
  void pin_corners(std::uint32_t triangle, const std::string& cause);
  bool input_begins_as_reference() const;
  /// Whether triangle i of triangles() is triangle i of the reference.
  bool is_of_reference(std::uint32_t i) const { return i < own_count_ && !is_piece(i); }
  bool added_triangles_are_open() const;
  Bounds* set_bounds(Team& team);
  void certify_input(const Certificate& certificate, std::span<const std::uint8_t> proved);
  void cover(double provable);
  void cover_divided(double provable);
  std::vector<std::uint8_t> face(double provable, Team& team);
  void pin_boundary();

  std::span<const glm::dvec3> vertices_;
  std::span<const glm::uvec3> input_triangles_;
  std::span<const glm::uvec3> triangles_;  ///< The triangles of joined_, if there are any, or those of the input.
  std::span<const std::uint32_t> wedges_;  ///< The wedges of triangles_.
  const ToleranceVolume* volume_;
  const DecimationOptions& options_;
  StoredSpace space_;
  DecimationResult& report_;

  std::optional<JoinedMesh> joined_;
  std::vector<std::uint32_t> joined_wedges_;
  CutMesh cut_;
  std::vector<glm::dvec3> positions_;  ///< Those of the cut mesh, in the frame; empty after take_mesh().
  std::vector<glm::dvec3> stored_;
  std::vector<bool> pinned_;  ///< For each vertex of the cut mesh.
  std::vector<std::uint32_t> islands_;
  /// Triangle i of the input is triangle i of the reference below this number, which is 0 or that of all triangles of
  /// the reference. All others were added, as to close holes. See is_of_reference() for pieces.
  std::size_t own_count_ = 0;
  bool reaches_out_of_cell_ = false;  ///< Whether some face is not strictly inside the cell.
  double mapping_error_ = 0;
  std::vector<std::uint32_t> element_of_;
  std::optional<TriangleCertificate> forward_;
  std::optional<Coverage> backward_;
  std::optional<BoundaryBounds> boundary_;
  std::optional<FacingRule> facing_;
  std::optional<CertifiedBounds> certified_;
  std::vector<std::uint32_t> exceeding_;
  std::vector<bool> exempt_;  ///< For each of triangles(): it is outside, or stands still outside of the cell.
  Bounds* bounds_ = nullptr;
};

}  // namespace tolvol
