// SPDX-License-Identifier: GPL-3.0-or-later
/// The greedy edge-collapse loop: cheapest edge first, each collapse checked when its turn comes.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "operation/bounded_mesh.h"
#include "operation/change.h"
#include "operation/position_fit.h"
#include "operation/quadric.h"
#include "reference/progress.h"

namespace tolvol {

class CollapseLoop {
 public:
  /// Changes `mesh`, and keeps a reference to it.
  explicit CollapseLoop(BoundedMesh& mesh);

  /// Collapses until no edge can or `target` triangles are left. O(n log n) without bounds. Throws Cancelled.
  void run(std::size_t target, Progress* progress);

 private:
  using Halfedge = BoundedMesh::Halfedge;
  using Edge = BoundedMesh::Edge;
  using Outcome = Change::Outcome;
  struct Entry {
    double cost;
    std::uint32_t edge, stamp;
  };
  using Freedom = BoundedMesh::Freedom;
  /// How an edge would be collapsed: the start of `halfedge` merges into its end, which goes to `position`.
  struct Plan {
    Halfedge halfedge;
    glm::dvec3 position;
    double cost;
    Freedom freedom;
  };

  void sum_quadrics();
  std::optional<Plan> plan(Edge e) const;
  Plan free_plan(Halfedge h) const;
  void push(Edge e);
  void collapse(Edge e);
  Outcome search(Halfedge h, const glm::dvec3& best);
  void renew(std::uint32_t vertex);

  BoundedMesh& mesh_;
  Change change_;
  PositionFit fit_;
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> stamps_;
  std::vector<bool> refused_;  ///< edges that failed a bound and wait for their neighbourhood to change
  std::size_t refused_count_ = 0;
  std::vector<Entry> heap_;
};

}  // namespace tolvol
