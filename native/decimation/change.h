// SPDX-License-Identifier: GPL-3.0-or-later
/// One change of a BoundedMesh, a collapse, a relocation or a flip, and the faces as it would leave them. It says
/// whether the mesh stays a manifold whose seams and sheets hold together; whether the bounds are kept, a ChangeTrial
/// says. It only reads the mesh.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "check/coverage.h"
#include "decimation/bounded_mesh.h"

namespace tolvol {

class Change {
 public:
  using Halfedge = BoundedMesh::Halfedge;
  using Edge = BoundedMesh::Edge;

  enum class Kind { collapse, relocate, flip };

  /// A face as the change would leave it; its corners are in Coverage::Element.
  struct Face {
    bool moves;  ///< Whether its corner number `corner` moves.
    int corner;
    glm::dvec3 before;  ///< Where the corner is before.
    std::uint32_t vertices[3];
  };
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
  explicit Change(const BoundedMesh& mesh) : mesh_(&mesh) {}

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
  const std::vector<Coverage::Element>& elements() const { return elements_; }
  const std::vector<Face>& faces() const { return faces_; }  ///< In the order of elements().
  const std::vector<Coverage::Removed>& removed() const { return removed_; }
  /// The halfedges of a collapse whose start merges into their end: one, or one in each sheet.
  const std::vector<Halfedge>& collapses() const { return collapses_; }
  /// The halfedge that a collapse was asked for: one of collapses().
  Halfedge halfedge() const { return halfedge_; }
  /// The copies of the vertex that vanishes in a collapse that move along with it and become copies of vertex().
  const std::vector<std::uint32_t>& carried() const { return carried_; }
  /// The copies of vertex(), without those that are carried, that move along with it.
  const std::vector<std::uint32_t>& moved_along() const { return moved_along_; }
  /// The edge of a flip.
  Edge edge() const { return edge_; }
  /// The vertex that a collapse leaves or that a relocation moves; none of a flip.
  std::optional<std::uint32_t> vertex() const { return kind_ == Kind::flip ? std::nullopt : std::optional(vertex_); }
  /// Where that vertex goes.
  const VertexPosition& position() const { return position_; }
  const std::vector<NewWedge>& new_wedges() const { return new_wedges_; }
  /// How much of the forward bound the vertex may use, and the points of a face.
  double share() const { return share_; }
  double share(const Face& face) const;

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

  const BoundedMesh* mesh_;
  Kind kind_ = Kind::collapse;
  Halfedge halfedge_;
  std::vector<Halfedge> collapses_;     ///< With the same edge of other sheets.
  std::vector<std::uint32_t> carried_;  ///< Copies of the vertex that vanishes that have no such edge.
  std::vector<std::uint32_t> moved_along_;
  Edge edge_;
  std::uint32_t vertex_ = 0;  ///< The vertex that moves.
  VertexPosition position_{};
  double share_ = 1;
  std::vector<Coverage::Element> elements_;
  std::vector<Face> faces_;
  std::vector<Coverage::Removed> removed_;
  std::vector<int> vanishing_;  ///< The faces that the collapses remove; negative numbers at a boundary.
  std::vector<NewWedge> new_wedges_;
  std::vector<std::uint32_t> apexes_, around_;
};

}  // namespace tolvol
