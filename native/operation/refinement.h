// SPDX-License-Identifier: GPL-3.0-or-later
/// Fewer triangles after the collapse loop has ended: vertices move to where they fit best and edges are flipped, which
/// makes room for further collapses, round after round until one brings nothing. Every step keeps the bounds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "operation/bounded_mesh.h"
#include "operation/change.h"
#include "operation/position_fit.h"
#include "reference/progress.h"

namespace tolvol {

class Refinement {
 public:
  /// Changes `mesh`, which needs a forward bound, and keeps a reference to it.
  explicit Refinement(BoundedMesh& mesh);

  /// Until some rounds collapse nothing, `target` triangles are left, or `expired`, asked before every step, says so.
  /// Throws Cancelled.
  void run(std::size_t target, const std::function<bool()>& expired, Progress* progress);

 private:
  using Edge = BoundedMesh::Edge;
  using Halfedge = BoundedMesh::Halfedge;

  void relocate(std::uint32_t vertex);
  void flip(Edge e);
  void collapse(Edge e);
  void apply();
  std::uint64_t last_touched(Edge e) const;

  BoundedMesh& mesh_;
  Change change_;
  PositionFit fit_;
  // Steps are counted; what failed is not tried again until a face around it has changed since.
  std::uint64_t clock_ = 1;
  std::vector<std::uint64_t> touched_;                          ///< per vertex: when a face around it changed last
  std::vector<std::uint64_t> relocated_, flipped_, collapsed_;  ///< per vertex, edge, edge: when it was tried last
};

}  // namespace tolvol
