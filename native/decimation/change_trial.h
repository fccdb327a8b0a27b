// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether a change of a BoundedMesh may be carried out: it is possible, turns no face over, puts no vertex where
/// another is, and keeps the bounds. A trial only reads the mesh until carry_out(), and holds all that it needs, so
/// that a thread each can try different changes of one mesh.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "decimation/bounded_mesh.h"
#include "decimation/change.h"
#include "decimation/replaced_faces.h"

namespace tolvol {

class ChangeTrial {
 public:
  using Halfedge = BoundedMesh::Halfedge;
  using Edge = BoundedMesh::Edge;

  /// Ordered: what was refused at one position may succeed at another, what is impossible cannot.
  enum class Outcome { impossible, refused, possible };

  /// Whether check() looks for the proofs of all bounds, or leaves them to a DeferredProof and asks only where the
  /// vertex is.
  enum class Proof { now, later };

  /// Keeps a reference to `mesh`.
  explicit ChangeTrial(const BoundedMesh& mesh, Proof proof = Proof::now) : change_(mesh), proof_(proof) {}

  /// Starts a series of tries around one place. What it finds depends on nothing before.
  void begin();

  Outcome try_collapse(Halfedge h, const VertexPosition& target);
  Outcome try_relocate(std::uint32_t vertex, const VertexPosition& target);
  Outcome try_flip(Edge e);

  // The steps of the above, for a search that wants to see the faces before it pays for the bounds. Each prepares the
  // change and says whether it is possible at all; check() then asks for the bounds.
  bool prepare_collapse(Halfedge h, const VertexPosition& target);
  bool prepare_relocate(std::uint32_t vertex, const VertexPosition& target);
  bool prepare_flip(Edge e);
  Outcome check();

  Proof proof() const { return proof_; }
  /// The change that was prepared last.
  const Change& change() const { return change_; }
  /// Whether one of the series of tries was refused because another vertex is where its vertex would be, or would be
  /// now: then it holds no longer than that vertex stays there.
  bool met_another() const { return met_another_ || (prepared_ && change_.meets_another()); }
  /// Parts of the reference's pieces that the series of tries has looked at.
  std::size_t looked_at() const { return backward_.looked_at(); }

  /// Carries out the change on `mesh`, on which check() found it possible and which is as it was then.
  void carry_out(BoundedMesh& mesh) const;

 private:
  bool keeps_bounds(const Change& change);
  bool vertex_is_inside(const Change& change);
  bool is_large(const Change& change, const Coverage::Element& e) const;
  bool shows_outside(const Change& change);
  bool faces_are_inside(const Change& change);
  void gather_replaced_faces(const Change& change);
  void gather_boundary(const Change& change);
  void boundary_of_collapse(const Change& change);
  void boundary_of_relocation(const Change& change);
  bool boundary_is_inside(const Change& change);

  Change change_;
  Proof proof_;
  bool prepared_ = false;  ///< a change of this series
  bool met_another_ = false;
  ReplacedFaces replaced_faces_;
  std::vector<Coverage::Element> boundary_elements_;
  std::vector<Coverage::Removed> boundary_removed_;
  Coverage::Trial backward_, boundary_backward_;
  double vertex_distance_ = 0;          ///< upper bounds on the distance to the reference, of the vertex
  std::vector<double> face_distances_;  ///< and of the faces of the change
  /// The face that failed last: of another try at the same place it is the likeliest to fail.
  std::size_t failed_last_ = 0;
};

}  // namespace tolvol
