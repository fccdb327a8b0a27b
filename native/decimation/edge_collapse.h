// SPDX-License-Identifier: GPL-3.0-or-later
/// The collapse of one edge: its cost, where its vertex goes, whether the bounds hold, and how it is carried out.
/// Others decide which edge's turn it is.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "base/parallel.h"
#include "decimation/bounded_mesh.h"
#include "decimation/change_trial.h"
#include "decimation/position_fit.h"
#include "decimation/quadric.h"

namespace tolvol {

class EdgeCollapse {
 public:
  using Halfedge = BoundedMesh::Halfedge;
  using Edge = BoundedMesh::Edge;
  using Outcome = ChangeTrial::Outcome;

  static constexpr double kNever = std::numeric_limits<double>::infinity();

  /// Changes `mesh`, and keeps a reference to it.
  EdgeCollapse(BoundedMesh& mesh, Team& team);

  const BoundedMesh& mesh() const { return mesh_; }

  /// The cost of an edge, by which edges are ordered; kNever for an edge that stays. Reads faces around its ends.
  double cost(std::uint32_t edge) const;

  /// The outcome of trying an edge, and the scratch of the try. Two threads must not share one.
  struct Attempt {
    Attempt(const BoundedMesh& mesh, Surroundings* around, ChangeTrial::Proof proof = ChangeTrial::Proof::now)
        : trial(mesh, around, proof), fit(mesh) {}
    /// Asks for positions that cost something, too, where the best one costs nothing.
    bool at_any_cost = false;
    Outcome outcome = Outcome::impossible;
    bool spared = false;  ///< Whether it was refused without asking for these positions.
    Halfedge halfedge;    ///< Its start would merge into its end.
    ChangeTrial trial;
    PositionFit fit;
  };
  /// Reads faces around the edge's two ends, and nothing else of the mesh that changes.
  void attempt(std::uint32_t edge, Attempt& a) const;
  /// Carries out an attempt that is possible on the mesh as it is.
  struct Carried {
    std::uint32_t vertex;  ///< The vertex that stays.
    Box changed;           ///< The box that ChangeTrial::carry_out() returns.
  };
  Carried carry_out(Attempt& a);

  const Quadric& quadric(std::uint32_t vertex) const { return quadrics_[vertex]; }
  /// Gives each vertex the quadric of the faces that are around it now, as when this was made. Each thread of the team
  /// sums those of a range of vertices, so that the sums do not depend on the number of threads. O(n).
  void sum_quadrics(Team& team);
  /// Puts a quadric back where collapses are taken back.
  void set_quadric(std::uint32_t vertex, const Quadric& quadric) { quadrics_[vertex] = quadric; }

 private:
  void sum_quadrics_of(std::uint32_t first, std::uint32_t last);

  using Freedom = BoundedMesh::Freedom;
  /// How an edge would be collapsed: the start of `halfedge` merges into its end, which goes to `position`.
  struct Plan {
    Halfedge halfedge;
    glm::dvec3 position;
    double cost;
    Freedom freedom;
  };

  Quadric quadric_of_copies(std::uint32_t vertex) const;
  std::optional<Plan> plan(Edge e) const;
  Plan free_plan(Halfedge h) const;
  Outcome search(Attempt& a, const glm::dvec3& best) const;

  BoundedMesh& mesh_;
  std::vector<Quadric> quadrics_;
};

}  // namespace tolvol
