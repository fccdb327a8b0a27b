// SPDX-License-Identifier: GPL-3.0-or-later
/// The greedy edge-collapse loop, over a whole mesh or over one of its regions beside others. It takes the cheapest
/// edge first, and checks each collapse when its turn comes or carries it out on trust.
///
/// With a team of threads it tries the next few edges ahead, all at once but for those in each other's way.
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
  /// The state that the loops over one mesh hand on to each other. Loops over different regions may run at once.
  struct Shared {
    explicit Shared(EdgeCollapse& collapse);
    /// Lets the next loop try the edges that were refused, wherever they are.
    void ask_again();
    EdgeCollapse& collapse;
    std::size_t before;                      ///< The number of triangles at the start.
    std::vector<std::uint32_t> stamps;       ///< For each edge, the stamp of the queues.
    std::vector<std::atomic<bool>> refused;  ///< Whether the edge waits for its neighbourhood to change.
    std::vector<std::uint8_t> spared;        ///< Whether the edge was spared then. Threads would share bits.
  };
  /// A loop over one region. If `later` is not null, collapses are noted there instead of being proved. `around` is
  /// null where crossings are allowed.
  CollapseLoop(Shared& shared, const Regions& regions, std::uint32_t region, Surroundings* around,
               DeferredProof* later);
  /// A loop over the whole mesh, on the threads of `team`.
  CollapseLoop(Shared& shared, Surroundings* around, Team& team);

  /// Adds an edge and its cost, before run().
  void add(std::uint32_t edge, double cost);
  /// The loop stops at an edge of this cost, or when the mesh has so many triangles left.
  struct Until {
    double cost;
    std::size_t triangles;
  };
  /// Collapses edges until then, or until no edge can collapse. O(n log n) without bounds. Throws Cancelled between two
  /// collapses.
  void run(const Until& until, Progress* progress);

 private:
  using Attempt = EdgeCollapse::Attempt;
  /// The outcome of trying an edge.
  struct Tried {
    EdgeCollapse::Outcome outcome = EdgeCollapse::Outcome::impossible;
    std::size_t looked_at = 0;           ///< The parts of the reference's pieces, and points of fits, that it took.
    bool spared = false;                 ///< Whether positions that cost something were not asked for.
    bool met_another = false;            ///< Whether a vertex was in the way that may have gone since.
    Box read{};                          ///< What was found of crossings depends on the faces in this box.
    std::unique_ptr<Attempt> attempt{};  ///< Null unless the collapse is possible.
  };

  /// The tries at a vertex with many faces around it; each costs as much as there are faces.
  struct Crowd {
    std::uint32_t faces;  ///< The number of faces around it at the first try.
    std::uint64_t work;   ///< All faces, parts of the reference's pieces and points of fits that the tries looked at.
  };

  /// An edge that was refused because faces would have crossed.
  struct Met {
    std::uint32_t edge;
    Box read;             ///< What was in the way is in this box.
    std::size_t changes;  ///< How many of changes_ were there then.
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
  bool is_next_to_crowd(std::uint32_t vertex) const;
  Box box_around(std::uint32_t edge) const;
  void carry_out(std::uint32_t edge, Tried& tried);
  std::unique_ptr<Attempt> take_attempt();
  void give_back(std::unique_ptr<Attempt> attempt);
  std::optional<double> risen(const CollapseQueue::Entry& entry) const;
  void renew(std::uint32_t edge);
  void renew_around(std::uint32_t vertex);
  void renew_ring(std::uint32_t vertex);
  void call_back(std::uint32_t vertex);
  bool call_back_met();
  bool call_back_spared();

  Shared& shared_;
  EdgeCollapse& collapse_;
  const BoundedMesh& mesh_;
  const Regions* regions_ = nullptr;  ///< Null for the whole mesh.
  std::uint32_t region_ = 0;
  Surroundings* around_ = nullptr;
  DeferredProof* later_ = nullptr;
  CollapseQueue queue_;
  TriesAhead ahead_;
  std::vector<Tried> tried_;  ///< For each slot of ahead_.
  /// For each vertex, the last batch of tries in which a face around it could change before its turn.
  std::vector<std::uint32_t> reserved_;
  std::vector<Box> reserved_boxes_;  ///< The boxes of space, in the last batch, in which a face could change so.
  std::vector<std::uint32_t> batch_of_end_;  ///< For each vertex, the last batch with an edge that ends there.
  /// Whether an end of an edge of the last batch has a great many neighbours, which are then not noted.
  bool crowd_in_batch_ = false;
  std::uint32_t batches_ = 0;        ///< The number of batches so far.
  std::vector<std::uint32_t> ring_;  ///< The neighbours of the vertex that vanished last.
  /// The crowds by vertex: those with many faces around them where a try was refused.
  std::unordered_map<std::uint32_t, Crowd> crowds_;
  bool at_any_cost_ = false;  ///< Whether the spared edges were called back.
  std::vector<Met> met_;      ///< The edges that were refused so, if there are no regions.
  bool called_back_ = false;  ///< Whether these were called back once.
  std::vector<Box> changes_;  ///< The boxes in which faces have changed since they were called back last.
  /// Attempts that are kept for their memory. The last one given back is taken first, because it is in the cache.
  std::vector<std::unique_ptr<Attempt>> idle_;
  std::mutex idle_mutex_;  ///< It guards idle_.
};

}  // namespace tolvol
