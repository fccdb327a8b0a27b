// SPDX-License-Identifier: GPL-3.0-or-later
/// The greedy edge-collapse loop: cheapest edge first, each collapse checked when its turn comes.
///
/// With several threads the next few edges are tried ahead, all at once, and what was found is kept for their turn. It
/// holds unless a face around the edge has changed meanwhile: the result is the same for any number of threads.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "operation/bounded_mesh.h"
#include "operation/change.h"
#include "operation/collapse_queue.h"
#include "operation/position_fit.h"
#include "operation/quadric.h"
#include "reference/parallel.h"
#include "reference/progress.h"

namespace tolvol {

class CollapseLoop {
 public:
  /// Changes `mesh`, and keeps a reference to it. `threads`: 0 means one per core.
  CollapseLoop(BoundedMesh& mesh, unsigned threads);

  /// Collapses until no edge can or `target` triangles are left. O(n log n) without bounds. Throws Cancelled.
  void run(std::size_t target, Progress* progress);

 private:
  using Halfedge = BoundedMesh::Halfedge;
  using Edge = BoundedMesh::Edge;
  using Outcome = Change::Outcome;
  using Freedom = BoundedMesh::Freedom;
  /// How an edge would be collapsed: the start of `halfedge` merges into its end, which goes to `position`.
  struct Plan {
    Halfedge halfedge;
    glm::dvec3 position;
    double cost;
    Freedom freedom;
  };
  /// What came of trying an edge: `change`, of `halfedge`.
  struct Attempt {
    explicit Attempt(const BoundedMesh& mesh) : change(mesh), fit(mesh) {}
    std::uint32_t edge = kNoEdge;
    std::uint32_t at = 0;  ///< of the collapses carried out
    Outcome outcome = Outcome::impossible;
    Halfedge halfedge;
    Change change;
    PositionFit fit;
  };
  static constexpr std::uint32_t kNoEdge = 0xFFFFFFFFu;

  void sum_quadrics();
  std::optional<Plan> plan(Edge e) const;
  Plan free_plan(Halfedge h) const;
  double cost(Edge e) const;
  void push(std::uint32_t edge, double cost);
  Attempt* found(std::uint32_t edge);
  Attempt& try_ahead(std::uint32_t edge);
  void attempt(Attempt& a) const;
  Outcome search(Attempt& a, const glm::dvec3& best) const;
  void carry_out(Attempt& a);
  void renew_around(std::uint32_t vertex);

  BoundedMesh& mesh_;
  Team team_;
  CollapseQueue queue_;
  std::vector<Quadric> quadrics_;
  std::vector<Attempt> attempts_;
  std::vector<std::uint32_t> attempt_of_;  ///< per edge: its place in attempts_, if that names the edge
  std::size_t next_ = 0;                   ///< place in attempts_ that is taken next, the longest taken
  std::uint32_t clock_ = 0;                ///< collapses carried out
  std::vector<std::uint32_t> touched_;     ///< per vertex: when a face around it changed last
  std::vector<bool> refused_;              ///< edges that failed a bound and wait for their neighbourhood to change
  std::size_t refused_count_ = 0;
};

}  // namespace tolvol
