// SPDX-License-Identifier: GPL-3.0-or-later
/// The greedy edge-collapse loop: cheapest edge first, each collapse checked when its turn comes or carried out on
/// trust, over a whole mesh or over one of its regions beside others.
///
/// With a team of threads the next few edges are tried ahead, all at once but for those in each other's way.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "decimation/collapse_queue.h"
#include "decimation/deferred_proof.h"
#include "decimation/edge_collapse.h"
#include "decimation/regions.h"
#include "decimation/tries_ahead.h"

namespace tolvol {

class CollapseLoop {
 public:
  /// What the loops over one mesh hand on to each other. Loops over different parts may run at once.
  struct Shared {
    explicit Shared(EdgeCollapse& collapse);
    EdgeCollapse& collapse;
    std::size_t before;                      ///< triangles
    std::vector<std::uint32_t> stamps;       ///< per edge, of the queues
    std::vector<std::atomic<bool>> refused;  ///< per edge: it failed a bound and waits for its neighbourhood to change
  };
  /// Over one region; what is collapsed is noted in `later`, if that is not null, instead of being proved.
  CollapseLoop(Shared& shared, const Regions& regions, std::uint32_t region, DeferredProof* later);
  /// Over the whole mesh, on the threads of `team`.
  CollapseLoop(Shared& shared, Team& team);

  /// Before run(): an edge, and its cost.
  void add(std::uint32_t edge, double cost);
  /// Where to stop: at an edge of such a cost, or with so many triangles left of the mesh.
  struct Until {
    double cost;
    std::size_t triangles;
  };
  /// Collapses until then, or until no edge can. O(n log n) without bounds. Throws Cancelled, between two collapses.
  void run(const Until& until, Progress* progress);

 private:
  using Attempt = EdgeCollapse::Attempt;
  /// What came of trying an edge.
  struct Tried {
    EdgeCollapse::Outcome outcome = EdgeCollapse::Outcome::impossible;
    std::size_t looked_at = 0;         ///< parts of the reference's pieces
    bool met_another = false;          ///< a vertex far away in the mesh, which may have gone
    std::unique_ptr<Attempt> attempt;  ///< where it is possible
  };

  /// Tries at a vertex with many faces around it: each costs as much as there are faces.
  struct Crowd {
    std::uint32_t faces;  ///< around it when the first of them was made
    std::uint64_t work;   ///< of all of them: faces and parts of the reference's pieces looked at
  };

  bool deleted(std::uint32_t edge) const;
  bool rationed(std::uint32_t edge) const;
  void note_refusal(std::uint32_t edge, const Tried& tried);
  bool ready(std::uint32_t vertex);
  bool own(std::uint32_t edge) const;
  Tried* found(std::uint32_t edge);
  Tried& try_ahead(std::uint32_t edge);
  std::vector<std::uint32_t> with_next(std::uint32_t edge);
  void try_now(std::uint32_t edge, Tried& tried);
  void reserve_around(std::uint32_t edge);
  bool reserved(std::uint32_t edge) const;
  void carry_out(std::uint32_t edge, Tried& tried);
  std::unique_ptr<Attempt> take_attempt();
  void give_back(std::unique_ptr<Attempt> attempt);
  std::optional<double> risen(const CollapseQueue::Entry& entry) const;
  void renew(std::uint32_t edge);
  void renew_around(std::uint32_t vertex);
  void renew_ring(std::uint32_t vertex);
  void call_back(std::uint32_t vertex);

  Shared& shared_;
  EdgeCollapse& collapse_;
  const BoundedMesh& mesh_;
  const Regions* regions_ = nullptr;  ///< null: the whole
  std::uint32_t region_ = 0;
  DeferredProof* later_ = nullptr;
  CollapseQueue queue_;
  TriesAhead ahead_;
  std::vector<Tried> tried_;  ///< per slot of ahead_
  /// Per vertex: the last batch of tries in which a face around it could change before the vertex's turn,
  std::vector<std::uint32_t> reserved_;
  std::vector<std::uint32_t> surrounded_;  ///< and the last one in which its neighbours were noted so
  std::uint32_t batches_ = 0;              ///< of tries, so far
  std::vector<std::uint32_t> ring_;        ///< neighbours of the vertex that vanished last
  /// By vertex, of those with many faces around them where a try was refused.
  std::unordered_map<std::uint32_t, Crowd> crowds_;
  /// Kept for their memory; the last given back is taken first, while it is in the cache.
  std::vector<std::unique_ptr<Attempt>> idle_;
  std::mutex idle_mutex_;  ///< guards idle_
};

}  // namespace tolvol
