// SPDX-License-Identifier: GPL-3.0-or-later
/// One change of a BoundedMesh under trial: the faces as they would be, and whether they keep the bounds. It only reads
/// the mesh, and holds all that a trial needs, so that a thread each can try different changes of one mesh.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "decimation/bounded_mesh.h"
#include "decimation/replaced_faces.h"

namespace tolvol {

class Change {
 public:
  using Halfedge = BoundedMesh::Halfedge;
  using Edge = BoundedMesh::Edge;

  enum class Kind { collapse, relocate, flip };

  /// Ordered: what was refused at one position may succeed at another, what is impossible cannot.
  enum class Outcome { impossible, refused, possible };

  /// A face as the change would leave it; its corners are in Coverage::Element.
  struct Face {
    bool moves;  ///< whether a corner of it moves: `corner`,
    int corner;
    glm::dvec3 before;  ///< from here
    std::uint32_t vertices[3];
    double distance;  ///< upper bound on the distance of its points to the reference
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

  /// Whether check() looks for the proofs of all bounds, or leaves them to a DeferredProof and asks only where the
  /// vertex is.
  enum class Proof { now, later };

  /// Keeps a reference to `mesh`.
  explicit Change(const BoundedMesh& mesh, Proof proof = Proof::now) : mesh_(&mesh), proof_(proof) {}

  /// The start of `h` merges into its end, which goes to `target`.
  Outcome try_collapse(Halfedge h, const VertexPosition& target);
  /// A vertex moves.
  Outcome try_relocate(std::uint32_t vertex, const VertexPosition& target);
  /// The edge of two faces becomes the other diagonal.
  Outcome try_flip(Edge e);

  // The steps of the above, for a search that wants to see the faces before it pays for the bounds. Each prepares the
  // faces and says whether the change is possible at all; check() then asks for the bounds.
  bool prepare_collapse(Halfedge h, const VertexPosition& target);
  bool prepare_relocate(std::uint32_t vertex, const VertexPosition& target);
  bool prepare_flip(Edge e);
  Outcome check();

  Proof proof() const { return proof_; }
  Kind kind() const { return kind_; }
  const std::vector<Coverage::Element>& elements() const { return elements_; }
  const std::vector<Face>& faces() const { return faces_; }  ///< parallel to elements()
  const std::vector<Coverage::Removed>& removed() const { return removed_; }
  /// Of a collapse, the halfedges whose start merges into their end: one, or one in each sheet.
  const std::vector<Halfedge>& collapses() const { return collapses_; }
  /// Of a collapse, the halfedge that it was asked for: one of collapses().
  Halfedge halfedge() const { return halfedge_; }
  /// Of a collapse, the copies of the vertex that vanishes that move along with it: they become copies of vertex().
  const std::vector<std::uint32_t>& carried() const { return carried_; }
  /// Of a flip.
  Edge edge() const { return edge_; }
  /// The vertex that a collapse leaves or that a relocation moves; none of a flip.
  std::optional<std::uint32_t> vertex() const { return kind_ == Kind::flip ? std::nullopt : std::optional(vertex_); }
  /// Where that vertex goes.
  const VertexPosition& position() const { return position_; }
  const std::vector<NewWedge>& new_wedges() const { return new_wedges_; }
  /// An upper bound on the distance to the reference there, where check() has asked the forward bound.
  double distance() const { return new_distance_; }
  /// Whether boundary edges with bounds of their own change.
  bool changes_boundary() const { return !boundary_elements_.empty(); }
  /// The trials of a check() that found the change possible.
  const Coverage::Trial& backward() const { return backward_; }
  const Coverage::Trial& boundary_backward() const { return boundary_backward_; }
  /// Whether one of the series of tries was refused because another vertex is where its vertex would be, or would be
  /// now: then it holds no longer than that vertex stays there.
  bool met_another() const { return met_another_ || meets_another(); }
  /// Parts of the reference's pieces that the series of tries has looked at.
  std::size_t looked_at() const { return backward_.looked_at(); }
  /// Starts a series of tries around one place. What it finds depends on nothing before.
  void begin() { failed_last_ = 0, met_another_ = false, backward_.begin(), boundary_backward_.begin(); }

 private:
  void clear(Kind kind, const VertexPosition& target);
  double share(const Face& face) const;
  void gather_side(std::uint32_t vertex, const glm::dvec3& position, double moved, int skip0, int skip1);
  bool link_condition(Halfedge h);
  bool gather(Halfedge h, const glm::dvec3& position);
  bool wedges_fit(Halfedge h);
  bool gather_copies(Halfedge h);
  bool slots_fit();
  bool meets_another() const;
  bool folds_over() const;
  void gather_replaced_faces();
  bool is_large(const Coverage::Element& e) const;
  bool vertex_is_inside();
  bool shows_outside();
  bool faces_are_inside();
  bool keeps_bounds();
  bool boundary_is_inside();
  void boundary_of_collapse();
  void boundary_of_relocation();

  const BoundedMesh* mesh_;
  Proof proof_;
  Kind kind_ = Kind::collapse;
  Halfedge halfedge_;
  std::vector<Halfedge> collapses_;     ///< with the same edge of other sheets
  std::vector<std::uint32_t> carried_;  ///< copies of the vertex that vanishes that have no such edge
  Edge edge_;
  std::uint32_t vertex_ = 0;  ///< the one that moves
  VertexPosition position_{};
  double share_ = 1;  ///< of the forward bound, at the vertex that moves
  std::vector<Coverage::Element> elements_;
  std::vector<Face> faces_;
  std::vector<Coverage::Removed> removed_;
  std::vector<Coverage::Element> boundary_elements_;
  std::vector<Coverage::Removed> boundary_removed_;
  std::vector<NewWedge> new_wedges_;
  std::vector<int> neighbours_;
  std::vector<std::uint32_t> apexes_, around_;
  ReplacedFaces replaced_faces_;
  Coverage::Trial backward_, boundary_backward_;
  double new_distance_ = 0;
  bool met_another_ = false;
  std::size_t failed_last_ =
      0;  ///< the face that failed last: of another try at the same place it is the likeliest to fail
};

}  // namespace tolvol
