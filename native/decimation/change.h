// SPDX-License-Identifier: GPL-3.0-or-later
/// One change of a BoundedMesh, a collapse, a relocation or a flip, and the faces as it would leave them. It says
/// whether the mesh stays a manifold whose seams and sheets hold together; whether the bounds are kept, a ChangeTrial
/// says. It only reads the mesh.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "check/changed_faces.h"
#include "decimation/bounded_mesh.h"

namespace tolvol {

class Change : public ChangedFaces {
 public:
  using Halfedge = BoundedMesh::Halfedge;
  using Edge = BoundedMesh::Edge;

  enum class Kind { collapse, relocate, flip };

  /// What a corner has at its vertex: its wedge, and the input corner of which it takes the attributes.
  struct Corner {
    std::uint32_t wedge, source;
  };
  struct NewWedge {
    std::uint32_t triangle;
    int corner;
    Corner gained;
  };

  /// Keeps a reference to `mesh`.
  explicit Change(const BoundedMesh& mesh) : ChangedFaces(mesh.frame_mesh(), mesh.shares()), mesh_(&mesh) {}

  // Each of these gathers the faces of another change, and returns whether that change is possible at all. If it is
  // not, nothing else may be asked of it.
  /// The start of `h` merges into its end, which goes to `target`.
  bool prepare_collapse(Halfedge h, const VertexPosition& target);
  /// A vertex moves.
  bool prepare_relocate(std::uint32_t vertex, const VertexPosition& target);
  /// The edge of two faces becomes the other diagonal.
  bool prepare_flip(Edge e);

  const BoundedMesh& mesh() const { return *mesh_; }
  Kind kind() const { return kind_; }
  /// The halfedges of a collapse whose start merges into their end: one, or one in each sheet.
  const std::vector<Halfedge>& collapses() const { return collapses_; }
  /// The halfedge that a collapse was asked for: one of collapses().
  Halfedge halfedge() const { return halfedge_; }
  /// The edge of a flip.
  Edge edge() const { return edge_; }
  const std::vector<NewWedge>& new_wedges() const { return new_wedges_; }

  /// Whether the vertex would be where another vertex is.
  bool meets_another() const;
  /// Whether the normal of a face would turn too far.
  bool folds_over() const;

 private:
  void clear(Kind kind, const VertexPosition& target);
  void gather_side(std::uint32_t vertex, const glm::dvec3& position);
  bool link_condition(Halfedge h);
  bool gather(Halfedge h, const glm::dvec3& position);
  bool wedges_fit(Halfedge h);
  bool gather_copies(Halfedge h);
  bool slots_fit();
  void gather_boundary();

  const BoundedMesh* mesh_;
  Kind kind_ = Kind::collapse;
  Halfedge halfedge_;
  std::vector<Halfedge> collapses_;  ///< With the same edge of other sheets.
  Edge edge_;
  std::vector<int> vanishing_;  ///< The faces that the collapses remove; negative numbers at a boundary.
  std::vector<NewWedge> new_wedges_;
  std::vector<std::uint32_t> apexes_, around_;
};

}  // namespace tolvol
