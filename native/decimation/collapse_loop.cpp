// SPDX-License-Identifier: GPL-3.0-or-later
// A refused edge waits until its two-ring changes. Around a vertex with many faces every collapse would call back all
// edges of the vertex, and each try costs as much as there are faces: all of it would cost the cube of their number.
// There the edges wait until an eighth of the faces has gone, and only some of the edges that come back are tried.
// Around a vertex with a great many faces a collapse calls back only the edges near the vertex that vanished. The costs
// of the other edges, which only rise while the vertex stays where it is, are renewed when their turn comes.
#include "decimation/collapse_loop.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "base/call.h"

namespace tolvol {
namespace {

// To find edges that can be tried at once, the loop looks at one edge for every kTrianglesPerAttempt triangles, but at
// no more than kMostAttempts edges. Collapses of more edges would come in each other's way.
constexpr std::size_t kTrianglesPerAttempt = 12, kMostAttempts = 64;
/// Tries are rationed at a vertex with more faces around it than this.
constexpr std::uint32_t kCrowded = 24;
/// The tries at such a vertex may look at this many faces, parts of the reference's pieces and points of fits together.
constexpr std::uint64_t kCrowdBudget = 1 << 14;
/// Costs are renewed late at a vertex with more faces around it than this.
constexpr std::uint32_t kGreatMany = 512;

}  // namespace

CollapseLoop::Shared::Shared(EdgeCollapse& c)
    : collapse(c),
      before(c.mesh().triangle_count()),
      stamps(c.mesh().connectivity().n_edges(), 0),
      refused(stamps.size()),
      spared(stamps.size(), 0) {}

void CollapseLoop::Shared::ask_again() {
  for (std::atomic<bool>& edge : refused) edge.store(false, std::memory_order_relaxed);
  std::ranges::fill(spared, std::uint8_t{0});
}

CollapseLoop::CollapseLoop(Shared& shared, const Regions& regions, std::uint32_t region, Surroundings* around,
                           DeferredProof* later)
    : shared_(shared),
      collapse_(shared.collapse),
      mesh_(collapse_.mesh()),
      regions_(&regions),
      region_(region),
      around_(around),
      later_(later),
      queue_(shared.stamps),
      tried_(1) {}

CollapseLoop::CollapseLoop(Shared& shared, Surroundings* around, Team& team)
    : shared_(shared),
      collapse_(shared.collapse),
      mesh_(collapse_.mesh()),
      around_(around),
      queue_(shared.stamps),
      tried_(1) {
  // A try looks up copies, which are beyond the faces around its edge.
  if (team.alone() || mesh_.has_copies()) return;
  // Edges of the last batch, too, may still be waiting for their turn.
  ahead_ = TriesAhead(team, 2 * kMostAttempts, mesh_.connectivity().n_edges(), mesh_.connectivity().n_vertices());
  tried_.resize(ahead_.slot_count());
  reserved_.assign(mesh_.connectivity().n_vertices(), 0);
  batch_of_end_.assign(mesh_.connectivity().n_vertices(), 0);
}

bool CollapseLoop::deleted(std::uint32_t edge) const {
  return mesh_.connectivity().status(BoundedMesh::edge(edge)).deleted();
}

/// Whether an end of the edge has had its share of tries.
bool CollapseLoop::rationed(std::uint32_t edge) const {
  if (crowds_.empty()) return false;
  const auto h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  return std::ranges::any_of(std::array{mesh_.from(h), mesh_.to(h)}, [&](std::uint32_t end) {
    const auto found = crowds_.find(end);
    return found != crowds_.end() && found->second.work >= kCrowdBudget;
  });
}

void CollapseLoop::note_refusal(std::uint32_t edge, const Tried& tried) {
  const auto h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  for (const std::uint32_t end : {mesh_.from(h), mesh_.to(h)}) {
    const std::uint32_t faces = mesh_.faces_around(end);
    if (faces > kCrowded) crowds_.try_emplace(end, Crowd{faces, 0}).first->second.work += faces + tried.looked_at;
  }
}

/// Whether the refused edges of the vertex may be tried again after a face around it has changed.
bool CollapseLoop::ready(std::uint32_t vertex) {
  const auto found = crowds_.find(vertex);
  if (found == crowds_.end()) return true;
  const std::uint32_t faces = mesh_.faces_around(vertex), before = found->second.faces;
  if (faces > before - before / 8 && faces < before + before / 8) return false;
  crowds_.erase(found);
  return true;
}

bool CollapseLoop::own(std::uint32_t edge) const { return !regions_ || regions_->of_edge(mesh_, edge) == region_; }

void CollapseLoop::add(std::uint32_t edge, double cost) {
  if (cost < EdgeCollapse::kNever) {
    queue_.push(edge, cost);
  } else {
    queue_.drop(edge);
  }
}

void CollapseLoop::run(const Until& until, Progress* progress) {
  for (std::size_t left; (left = mesh_.triangle_count()) > until.triangles;) {
    poll();
    if (progress) {
      progress->set_count(left);
      progress->update(static_cast<double>(shared_.before - left) / static_cast<double>(shared_.before));
    }
    const auto entry = queue_.pop();
    if (!entry && (call_back_met() || call_back_spared())) continue;
    if (!entry || entry->cost >= until.cost) break;
    if (deleted(entry->edge)) continue;
    if (rationed(entry->edge)) {
      shared_.refused[entry->edge].store(true, std::memory_order_relaxed);
      continue;
    }
    if (const auto later = risen(*entry)) {
      add(entry->edge, *later);
      continue;
    }
    Tried* const tried = found(entry->edge);
    carry_out(entry->edge, tried ? *tried : try_ahead(entry->edge));
  }
}

/// The present cost of an edge, if it has risen and was not renewed.
std::optional<double> CollapseLoop::risen(const CollapseQueue::Entry& entry) const {
  const auto h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(entry.edge), 0);
  if (std::max(mesh_.faces_around(mesh_.from(h)), mesh_.faces_around(mesh_.to(h))) <= kGreatMany) return std::nullopt;
  const double cost = collapse_.cost(entry.edge);
  return cost > entry.cost ? std::optional(cost) : std::nullopt;
}

/// The outcome that was found for the edge ahead, if it still holds; else null.
CollapseLoop::Tried* CollapseLoop::found(std::uint32_t edge) {
  if (ahead_.alone()) return nullptr;
  const auto h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  const auto slot = ahead_.found(edge, std::array{mesh_.from(h), mesh_.to(h)});
  if (!slot) return nullptr;
  Tried& tried = tried_[*slot];
  if (ahead_.changed_since(*slot, tried.read)) return nullptr;
  return tried.met_another || (tried.attempt && tried.attempt->trial.met_another()) ? nullptr : &tried;
}

std::unique_ptr<CollapseLoop::Attempt> CollapseLoop::take_attempt() {
  const std::lock_guard lock(idle_mutex_);
  if (idle_.empty())
    return std::make_unique<Attempt>(mesh_, around_, later_ ? ChangeTrial::Proof::later : ChangeTrial::Proof::now);
  std::unique_ptr<Attempt> last = std::move(idle_.back());
  idle_.pop_back();
  return last;
}

void CollapseLoop::give_back(std::unique_ptr<Attempt> attempt) {
  if (!attempt) return;
  const std::lock_guard lock(idle_mutex_);
  idle_.push_back(std::move(attempt));
}

void CollapseLoop::try_now(std::uint32_t edge, Tried& tried) {
  give_back(std::move(tried.attempt));  // The attempt of an edge whose turn did not come.
  std::unique_ptr<Attempt> attempt = take_attempt();
  attempt->at_any_cost = at_any_cost_;
  collapse_.attempt(edge, *attempt);
  tried = {attempt->outcome, attempt->trial.looked_at() + attempt->fit.looked_at(), attempt->spared,
           attempt->trial.met_another(), attempt->trial.read()};
  if (tried.outcome == EdgeCollapse::Outcome::possible) {
    tried.attempt = std::move(attempt);
  } else {
    give_back(std::move(attempt));
  }
}

/// Tries the edge and, with several threads, those that would come next.
CollapseLoop::Tried& CollapseLoop::try_ahead(std::uint32_t edge) {
  const auto try_one = [&](std::uint32_t each, std::size_t slot) { try_now(each, tried_[slot]); };
  return tried_[ahead_.alone() ? ahead_.run({&edge, 1}, try_one) : ahead_.run(with_next(edge), try_one)];
}

/// The edge, and those edges that would come next and are not in each other's way.
std::vector<std::uint32_t> CollapseLoop::with_next(std::uint32_t edge) {
  std::vector<std::uint32_t> batch{edge};
  const std::size_t most = std::clamp<std::size_t>(mesh_.triangle_count() / kTrianglesPerAttempt, 1, kMostAttempts);
  std::vector<CollapseQueue::Entry> next;
  ++batches_;
  reserved_boxes_.clear();
  crowd_in_batch_ = false;
  reserve_around(edge);
  while (next.size() + 1 < most) {
    const auto entry = queue_.pop();
    if (!entry) break;
    if (deleted(entry->edge)) continue;
    next.push_back(*entry);
    const Tried* const tried = found(entry->edge);
    if (!tried && !reserved(entry->edge)) batch.push_back(entry->edge);
    if (!tried || tried->outcome == EdgeCollapse::Outcome::possible) reserve_around(entry->edge);
  }
  for (const CollapseQueue::Entry& entry : next) queue_.push(entry.edge, entry.cost);
  return batch;
}

/// Reserves the vertices around the edge, and where crossings are kept out the space that its faces take up: once it is
/// collapsed, nothing holds that was found for the edges there.
void CollapseLoop::reserve_around(std::uint32_t edge) {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  const auto h = connectivity.halfedge_handle(BoundedMesh::edge(edge), 0);
  if (around_) reserved_boxes_.push_back(box_around(edge));
  for (const std::uint32_t end : {mesh_.from(h), mesh_.to(h)}) {
    // Edges that come one after another often share an end that has many neighbours.
    if (std::exchange(batch_of_end_[end], batches_) == batches_) continue;
    reserved_[end] = batches_;
    if (mesh_.faces_around(end) > kGreatMany) {
      crowd_in_batch_ = true;
      continue;
    }
    for (const auto near : connectivity.vv_range(BoundedMesh::handle(end))) {
      reserved_[static_cast<std::size_t>(near.idx())] = batches_;
    }
  }
}

bool CollapseLoop::reserved(std::uint32_t edge) const {
  const auto h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  for (const std::uint32_t end : {mesh_.from(h), mesh_.to(h)}) {
    if (reserved_[end] == batches_ || is_next_to_crowd(end)) return true;
  }
  if (!around_) return false;
  const Box box = box_around(edge);
  return std::ranges::any_of(reserved_boxes_, [&](const Box& other) { return meet(box, other); });
}

/// Whether the vertex may be next to an end, of an edge of the batch, that has a great many neighbours.
bool CollapseLoop::is_next_to_crowd(std::uint32_t vertex) const {
  if (!crowd_in_batch_) return false;
  if (mesh_.faces_around(vertex) > kGreatMany) return true;
  return std::ranges::any_of(mesh_.connectivity().vv_range(BoundedMesh::handle(vertex)), [&](const auto& near) {
    const auto end = static_cast<std::uint32_t>(near.idx());
    return batch_of_end_[end] == batches_ && mesh_.faces_around(end) > kGreatMany;
  });
}

/// A box of stored positions around the faces at the ends of the edge; around everything where these are a great many.
Box CollapseLoop::box_around(std::uint32_t edge) const {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  const auto h = connectivity.halfedge_handle(BoundedMesh::edge(edge), 0);
  Box box;
  for (const std::uint32_t end : {mesh_.from(h), mesh_.to(h)}) {
    if (mesh_.faces_around(end) > kGreatMany) return {glm::dvec3(-kFar), glm::dvec3(kFar)};
    for (const auto near : connectivity.vv_range(BoundedMesh::handle(end))) {
      box.add(mesh_.stored(static_cast<std::uint32_t>(near.idx())));
    }
  }
  return box;
}

void CollapseLoop::carry_out(std::uint32_t edge, Tried& tried) {
  if (tried.outcome == EdgeCollapse::Outcome::possible) {
    if (later_) later_->note(tried.attempt->trial.change());
    const auto h = tried.attempt->halfedge;
    const glm::dvec3 before = mesh_.position(mesh_.to(h));
    ring_.clear();
    // This sum is the most faces that the kept vertex can have afterwards.
    if (mesh_.faces_around(mesh_.from(h)) + mesh_.faces_around(mesh_.to(h)) > kGreatMany) {
      for (const auto near : mesh_.connectivity().vv_range(BoundedMesh::handle(mesh_.from(h)))) {
        ring_.push_back(static_cast<std::uint32_t>(near.idx()));
      }
    }
    const auto [kept, changed] = collapse_.carry_out(*tried.attempt);
    ahead_.note_change(changed);
    if (called_back_) changes_.push_back(changed);
    const bool stayed = mesh_.position(kept) == before && !mesh_.joined(kept);
    if (stayed && mesh_.faces_around(kept) > kGreatMany) {
      renew_ring(kept);
    } else {
      for (const std::uint32_t copy : mesh_.copies(kept)) renew_around(copy);
    }
    give_back(std::move(tried.attempt));
  } else if (tried.outcome == EdgeCollapse::Outcome::refused) {
    note_refusal(edge, tried);
    if (!later_) {
      shared_.refused[edge].store(true, std::memory_order_relaxed);
      shared_.spared[edge] = tried.spared;
    }
    // Crossings are looked for last, so that all else would have held.
    if (!regions_ && !tried.read.empty()) met_.push_back({edge, tried.read, changes_.size()});
  }
  ahead_.drop(edge);
}

void CollapseLoop::renew(std::uint32_t edge) {
  if (own(edge)) add(edge, collapse_.cost(edge));
}

/// Puts back the edges that were refused because faces would have crossed, and returns whether there are any: what was
/// in the way may be a sheet that is no neighbour. After the first time only those come back near which something has
/// changed since they were refused.
bool CollapseLoop::call_back_met() {
  bool any = false;
  std::vector<Met> waiting;
  for (const Met& met : met_) {
    poll();
    if (deleted(met.edge) || !shared_.refused[met.edge]) continue;
    const auto since = std::span(changes_).subspan(met.changes);
    if (called_back_ && std::ranges::none_of(since, [&](const Box& box) { return meet(box, met.read); })) {
      waiting.push_back(met);
      waiting.back().changes = 0;
      continue;
    }
    shared_.refused[met.edge].store(false, std::memory_order_relaxed);
    renew(met.edge);
    any = true;
  }
  met_ = std::move(waiting);
  changes_.clear();
  called_back_ = true;
  return any;
}

/// Puts back, once, the edges of the whole mesh that were spared, and returns whether there are any. Nothing else can
/// collapse by now, so that hardly anything is left for which to spare them.
bool CollapseLoop::call_back_spared() {
  if (regions_ || std::exchange(at_any_cost_, true)) return false;
  bool any = false;
  for (std::uint32_t edge = 0; edge < shared_.spared.size(); ++edge) {
    poll_at(edge);
    if (!shared_.spared[edge] || !shared_.refused[edge] || deleted(edge)) continue;
    shared_.refused[edge].store(false, std::memory_order_relaxed);
    renew(edge);
    any = true;
  }
  return any;
}

/// After a collapse, renews the costs that it changes, and calls back edges that may now be possible.
void CollapseLoop::renew_around(std::uint32_t vertex) {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  const auto v = BoundedMesh::handle(vertex);
  ahead_.advance();
  ahead_.note_change(vertex);
  for (const auto e : connectivity.ve_range(v)) renew(static_cast<std::uint32_t>(e.idx()));
  for (const auto near : connectivity.vv_range(v)) call_back(static_cast<std::uint32_t>(near.idx()));
}

/// Does so only near the vertex that vanished, whose neighbours are in ring_; `vertex` has stayed where it was.
void CollapseLoop::renew_ring(std::uint32_t vertex) {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  ahead_.advance();
  ahead_.note_change(vertex);
  for (const std::uint32_t near : ring_) {
    if (near == vertex) continue;
    const auto h = connectivity.find_halfedge(BoundedMesh::handle(near), BoundedMesh::handle(vertex));
    if (h.is_valid()) renew(static_cast<std::uint32_t>(connectivity.edge_handle(h).idx()));
    call_back(near);
  }
}

/// Puts the refused edges of the vertex back into the queue, because they may now be possible. The edges of a vertex
/// with a great many faces are called back from their other ends.
void CollapseLoop::call_back(std::uint32_t vertex) {
  ahead_.note_change(vertex);
  if (mesh_.faces_around(vertex) > kGreatMany || (!crowds_.empty() && !ready(vertex))) return;
  for (const auto e : mesh_.connectivity().ve_range(BoundedMesh::handle(vertex))) {
    // At a rim another region may read and write it, too.
    std::atomic<bool>& refused = shared_.refused[static_cast<std::size_t>(e.idx())];
    if (!refused.load(std::memory_order_relaxed)) continue;
    refused.store(false, std::memory_order_relaxed);
    renew(static_cast<std::uint32_t>(e.idx()));
  }
}

}  // namespace tolvol
