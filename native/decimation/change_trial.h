// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether a collapse in a BoundedMesh may be carried out: it is possible, turns no face over, puts no vertex where
/// another is, and keeps the bounds. A trial only reads the mesh until carry_out(), and holds all that it needs, so
/// that a thread each can try different collapses in one mesh.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>

#include "check/bounds.h"
#include "decimation/bounded_mesh.h"
#include "decimation/change.h"
#include "decimation/surroundings.h"

namespace tolvol {

class ChangeTrial {
 public:
  using Halfedge = BoundedMesh::Halfedge;

  /// Ordered: what was refused at one position may succeed at another, what is impossible cannot.
  enum class Outcome { impossible, refused, possible };

  /// Whether check() looks for the proofs of all bounds, or leaves them to a DeferredProof and asks only where the
  /// vertex is.
  enum class Proof { now, later };

  /// Keeps references to `mesh` and its bounds, and to `around`, which is null where crossings are allowed. Proofs of
  /// certificates alone can be left for later, and then crossings are.
  explicit ChangeTrial(const BoundedMesh& mesh, Surroundings* around, Proof proof = Proof::now);

  /// Starts a series of tries around one place. What it finds depends on nothing before.
  void begin();

  Outcome try_collapse(Halfedge h, const VertexPosition& target);

  // The steps of the above, for a search that wants to see the faces before it pays for the bounds. The first prepares
  // the change and says whether it is possible at all; check() then asks for the bounds.
  bool prepare_collapse(Halfedge h, const VertexPosition& target);
  Outcome check();

  Proof proof() const { return proof_; }
  /// The change that was prepared last.
  const Change& change() const { return change_; }
  /// Whether one of the series of tries was refused because another vertex is where its vertex would be, or would be
  /// now: then it holds no longer than that vertex stays there.
  bool met_another() const { return met_another_ || (prepared_ && change_.meets_another()); }
  /// Parts of the reference's pieces that the series of tries has looked at.
  std::size_t looked_at() const { return bounds_ ? bounds_->looked_at() : 0; }

  /// What the series of tries found of crossings depends on no face outside this box of stored positions.
  const Box& read() const { return crossings_.crossings.read(); }

  /// Carries out the change on `mesh`, on which check() found it possible and which is as it was then. Returns a box
  /// of stored positions around all faces that it changes. The box is empty where crossings were not looked for.
  Box carry_out(BoundedMesh& mesh);

 private:
  Change change_;
  Surroundings* around_;  ///< Null where crossings are allowed.
  Surroundings::Trial crossings_;
  Proof proof_;
  bool prepared_ = false;  ///< Whether a change of this series was prepared.
  bool met_another_ = false;
  std::unique_ptr<Bounds::Trial> bounds_;  ///< Null where the mesh has no bounds.
};

}  // namespace tolvol
