// SPDX-License-Identifier: GPL-3.0-or-later
/// Removes more triangles after the collapse loop has ended. It collapses edges one after another and moves all
/// vertices around each together, so that a collapse has room that no single vertex could make. Every step keeps the
/// bounds.
///
/// It tries steps in a fixed order. With several threads it tries the next few steps ahead, all at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "decimation/bounded_mesh.h"
#include "decimation/refinement/patch_trial.h"
#include "decimation/refinement/surface_samples.h"
#include "decimation/tries_ahead.h"

namespace tolvol {

class Refinement {
 public:
  /// How many tries of a round may fail. A success makes up for some failures, so that a round ends where hardly one
  /// try in fifty succeeds, too.
  class Patience {
   public:
    /// `steps` is the number of edges that may be tried.
    explicit Patience(std::size_t steps);
    bool is_over() const { return failures_ >= most_failures_; }
    void note(bool success);

   private:
    std::size_t most_failures_, failures_ = 0;
  };

  /// How many searches the tries of all rounds of one Refinement may take (PatchTrial::work()).
  class Budget {
   public:
    /// From now on as much as was taken so far, and some more. Before, there is no limit.
    void limit();
    bool is_over() const { return work_ >= most_; }
    void note(std::size_t work) { work_ += work; }

   private:
    std::size_t work_ = 0, most_ = std::numeric_limits<std::size_t>::max();
  };

  /// Changes `mesh`, whose bounds are certified, and keeps references to all. `crossings` is null where crossings are
  /// allowed.
  Refinement(BoundedMesh& mesh, NewCrossings* crossings, Team& team);

  /// Runs until hardly a collapse succeeds any more or `target` triangles are left. Throws Cancelled, and then leaves a
  /// mesh that is proved. A step takes 1 to 10 ms on one thread, and one in ten succeeds.
  void run(std::size_t target, Progress* progress);

 private:
  /// The outcome of trying to collapse an edge, and the scratch of the try.
  struct Attempt {
    Attempt(const BoundedMesh& mesh, const SurfaceSamples& samples, Surroundings* around)
        : trial(mesh, samples, around) {}
    PatchTrial trial;
    std::vector<std::uint32_t> read;  ///< The vertices around which the try reads.
    bool possible = false;
    double reached = 0;  ///< The largest deviation that the try came to, over the tolerance.
    std::size_t work = 0;
  };
  struct Reached {
    std::uint64_t at = 0;
    double largest = 0;
  };

  void find_prices();
  std::vector<std::uint32_t> order() const;
  bool round(std::size_t most_edges, std::size_t target, Progress* progress);
  bool wanted(std::uint32_t edge) const;
  Attempt& tried(std::span<const std::uint32_t> steps, std::size_t place);
  void attempt(std::uint32_t edge, Attempt& a) const;
  void carry_out(Attempt& a);
  /// When a face around one of the ends of an edge changed last.
  std::uint64_t touched(std::uint32_t edge) const;
  bool alive(std::uint32_t edge) const { return !mesh_.connectivity().status(BoundedMesh::edge(edge)).deleted(); }

  BoundedMesh& mesh_;
  Team& team_;
  SurfaceSamples samples_;
  std::optional<Surroundings> around_;
  TriesAhead ahead_;
  std::vector<Attempt> attempts_;  ///< For each slot of ahead_.
  PatchTrial::Effort effort_{};
  Budget budget_;
  // A step that failed is not tried again until a face around it has changed. The times are those of ahead_.
  std::vector<std::uint64_t> touched_;         ///< For each vertex: when a face around it changed last.
  std::vector<std::uint64_t> tried_, priced_;  ///< For each edge: when it was tried and when its price was found last.
  std::vector<std::optional<PatchTrial::Price>> prices_;  ///< For each edge.
  std::vector<Reached> reached_;  ///< For each edge: when it was tried last and how near to success it came.
};

}  // namespace tolvol
