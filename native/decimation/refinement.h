// SPDX-License-Identifier: GPL-3.0-or-later
/// Removes more triangles after the collapse loop has ended: it moves vertices to where they fit best and flips edges,
/// which makes room for further collapses, round after round until a few rounds collapse nothing. Every step keeps the
/// bounds.
///
/// It tries steps in a fixed order. With several threads it tries the next few steps ahead, all at once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "decimation/bounded_mesh.h"
#include "decimation/change_trial.h"
#include "decimation/position_fit.h"
#include "decimation/tries_ahead.h"

namespace tolvol {

class Refinement {
 public:
  /// Changes `mesh`, whose bounds are certified, and keeps references to all. `crossings` is null where crossings are
  /// allowed.
  Refinement(BoundedMesh& mesh, NewCrossings* crossings, Team& team);

  /// Runs until a few rounds collapse nothing, `target` triangles are left, or `expired`, which is asked before every
  /// step, returns true. Throws Cancelled.
  void run(std::size_t target, const std::function<bool()>& expired, Progress* progress);

 private:
  using Halfedge = BoundedMesh::Halfedge;

  /// The outcome of trying a step, and the scratch of the try.
  struct Attempt {
    Attempt(const BoundedMesh& mesh, Surroundings* around) : trial(mesh, around), fit(mesh) {}
    ChangeTrial trial;
    PositionFit fit;
    bool possible = false;
  };
  /// The vertices around which a try reads; some may be named more than once.
  using Read = std::array<std::uint32_t, 4>;
  /// A kind of step; each step is about a vertex or an edge.
  struct Kind {
    Read (Refinement::*read)(std::uint32_t) const;
    bool (Refinement::*wanted)(std::uint32_t) const;
    void (Refinement::*attempt)(std::uint32_t, Attempt&) const;
    void (Refinement::*carry_out)(std::uint32_t, Attempt&);
  };

  bool sweep(const Kind& kind, std::span<const std::uint32_t> steps, const std::function<bool()>& go_on);
  Attempt& tried(const Kind& kind, std::span<const std::uint32_t> steps, std::size_t place);

  Read read_at(std::uint32_t vertex) const { return {vertex, vertex, vertex, vertex}; }
  bool relocation_wanted(std::uint32_t vertex) const;
  void try_relocation(std::uint32_t vertex, Attempt& a) const;
  bool find_move(std::uint32_t vertex, Attempt& a) const;
  void relocate(std::uint32_t vertex, Attempt& a);

  /// The later of the times of an edge's two ends.
  std::uint64_t at_ends(const std::vector<std::uint64_t>& times, std::uint32_t edge) const;
  Read read_at_ends(std::uint32_t edge) const;
  Read read_at_diagonals(std::uint32_t edge) const;
  bool flip_wanted(std::uint32_t edge) const;
  void try_flip(std::uint32_t edge, Attempt& a) const;
  void flip(std::uint32_t edge, Attempt& a);

  bool collapse_wanted(std::uint32_t edge) const;
  void try_collapse(std::uint32_t edge, Attempt& a) const;
  void collapse(std::uint32_t edge, Attempt& a);

  void apply(Attempt& a);

  static constexpr Kind kRelocation{&Refinement::read_at, &Refinement::relocation_wanted, &Refinement::try_relocation,
                                    &Refinement::relocate};
  static constexpr Kind kFlip{&Refinement::read_at_diagonals, &Refinement::flip_wanted, &Refinement::try_flip,
                              &Refinement::flip};
  static constexpr Kind kCollapse{&Refinement::read_at_ends, &Refinement::collapse_wanted, &Refinement::try_collapse,
                                  &Refinement::collapse};

  BoundedMesh& mesh_;
  std::optional<Surroundings> around_;
  TriesAhead ahead_;
  std::vector<Attempt> attempts_;  ///< For each slot of ahead_.
  // A step that failed is not tried again until a face around it has changed. The times are those of ahead_.
  std::vector<std::uint64_t> touched_;  ///< For each vertex: when a face around it changed last.
  std::vector<std::uint64_t> relocated_, flipped_,
      collapsed_;  ///< For each vertex, edge and edge: when it was tried last.
};

}  // namespace tolvol
