// SPDX-License-Identifier: GPL-3.0-or-later
// To alternate collapses, flips and moves of vertices is an idea of H. Hoppe et al., "Mesh optimization", 1993. Here
// the certificates of both directions decide which steps are allowed, and not an energy; and what moves is a whole
// neighbourhood at once, because a vertex alone soon finds no room at irregular valences.
#include "decimation/refinement/refinement.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "base/call.h"

namespace tolvol {
namespace {

/// A round ends after kMostFailures failures, or as many as this share of its edges if that is more. A success makes up
/// for kMadeUpFor failures.
constexpr std::size_t kMostFailures = 40, kMadeUpFor = 25;
constexpr double kMostFailuresShare = 0.125;
/// If a round has more edges than this, each of them gets only a quick try.
constexpr std::size_t kMany = 320;
constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();
/// The rounds, in order. A round is repeated until it removes nothing. Many starts take ten times as long, and are
/// worth it only where all else has failed; with three rings, seconds for each hundred edges. A round that would have
/// more edges than `most_edges` is left out. A round with many starts that removes nothing is the last.
constexpr struct {
  int rings;
  bool many_starts;
  std::size_t most_edges;
} kRounds[] = {
    {2, false, kAnyNumber}, {3, false, kAnyNumber}, {4, false, kAnyNumber}, {2, true, kAnyNumber}, {3, true, kMany}};
/// All rounds with many starts together may take as many searches as the rounds before them, and kStartsWork more: most
/// of what they remove comes early, and of a small part with straight edges they would try the same edges for minutes.
constexpr std::size_t kStartsWork = 50'000'000;
/// An edge is not tried if the deviation with its vertex alone moved is beyond so many tolerances.
constexpr double kMostLargest = 2;
/// The number of steps that are tried at once, for each thread. More would often be in vain, because one before them
/// succeeds near by.
constexpr std::size_t kAhead = 2;
/// An edge is not tried with more vertices moving if it came to a deviation of more than kMostReached tolerances
/// before. Edges that were not tried yet stand in the order as if they had come to kUntried tolerances.
constexpr double kMostReached = 1.2, kUntried = 1.1;

}  // namespace

Refinement::Patience::Patience(std::size_t steps)
    : most_failures_(
          std::max(kMostFailures, static_cast<std::size_t>(kMostFailuresShare * static_cast<double>(steps)))) {}

void Refinement::Patience::note(bool success) {
  if (success) {
    failures_ -= std::min(failures_, kMadeUpFor);
  } else {
    ++failures_;
  }
}

void Refinement::Budget::limit() { most_ = 2 * work_ + kStartsWork; }

Refinement::Refinement(BoundedMesh& mesh, NewCrossings* crossings, Team& team)
    : mesh_(mesh),
      team_(team),
      samples_(mesh, team),
      touched_(mesh.connectivity().n_vertices(), 1),
      tried_(mesh.connectivity().n_edges(), 0),
      priced_(mesh.connectivity().n_edges(), 0),
      prices_(mesh.connectivity().n_edges()),
      reached_(mesh.connectivity().n_edges()) {
  // A try looks up copies, which are beyond the faces around its step.
  if (!team.alone() && !mesh.has_copies()) {
    ahead_ =
        TriesAhead(team, 2 * kAhead * team.size(), mesh.connectivity().n_edges(), mesh.connectivity().n_vertices());
  }
  if (crossings) around_.emplace(mesh, *crossings, team);
  while (attempts_.size() < ahead_.slot_count()) attempts_.emplace_back(mesh, samples_, around_ ? &*around_ : nullptr);
}

void Refinement::run(std::size_t target, Progress* progress) {
  if (progress) progress->begin("refining");
  for (const auto& [rings, many_starts, most_edges] : kRounds) {
    if (many_starts && !effort_.many_starts) budget_.limit();
    effort_.rings = rings, effort_.many_starts = many_starts;
    std::ranges::fill(tried_, 0);
    const std::size_t at_first = mesh_.triangle_count();
    for (std::size_t before = 0; before != mesh_.triangle_count();) {
      before = mesh_.triangle_count();
      if (!round(most_edges, target, progress)) return;
    }
    if (many_starts && mesh_.triangle_count() == at_first) return;
  }
}

std::uint64_t Refinement::touched(std::uint32_t edge) const {
  const auto h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  return std::max(touched_[mesh_.from(h)], touched_[mesh_.to(h)]);
}

void Refinement::find_prices() {
  constexpr std::size_t kBlock = 32;
  team_.run(prices_.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::optional<PatchTrial> trial;
    for (auto e = static_cast<std::uint32_t>(begin); e < end; ++e) {
      if (!alive(e) || touched(e) <= priced_[e]) continue;
      if (!trial) trial.emplace(mesh_, samples_, nullptr);
      prices_[e] = trial->price(BoundedMesh::edge(e));
      priced_[e] = ahead_.now();
    }
  });
}

/// The edges that may be worth a try, the cheapest first.
std::vector<std::uint32_t> Refinement::order() const {
  std::vector<std::tuple<double, double, std::uint32_t>> found;
  for (std::uint32_t e = 0; e < prices_.size(); ++e) {
    if (!wanted(e) || !prices_[e] || prices_[e]->largest > kMostLargest) continue;
    // What was tried with fewer vertices moving comes by how near it came to success.
    const bool was_tried = reached_[e].at >= touched(e);
    if (was_tried && reached_[e].largest > kMostReached) continue;
    found.emplace_back(was_tried ? reached_[e].largest : kUntried, prices_[e]->rise, e);
  }
  std::ranges::sort(found);
  std::vector<std::uint32_t> edges;
  edges.reserve(found.size());
  for (const auto& [reached, rise, e] : found) edges.push_back(e);
  return edges;
}

/// Tries the edges in the order of their prices, and returns whether more triangles than the target are left.
bool Refinement::round(std::size_t most_edges, std::size_t target, Progress* progress) {
  find_prices();
  const std::vector<std::uint32_t> steps = order();
  if (steps.size() > most_edges) return true;
  ahead_.drop_all();
  Patience patience(steps.size());
  effort_.quick = steps.size() > kMany;
  for (std::size_t place = 0; place < steps.size() && !patience.is_over() && !budget_.is_over(); ++place) {
    poll();
    if (progress) {
      progress->set_count(mesh_.triangle_count());
      progress->poll();
    }
    if (mesh_.triangle_count() <= target) return false;
    if (!wanted(steps[place])) continue;
    Attempt& a = tried(steps, place);
    tried_[steps[place]] = ahead_.now();
    reached_[steps[place]] = {ahead_.now(), a.reached};
    budget_.note(a.work);
    patience.note(a.possible);
    if (a.possible) carry_out(a);
  }
  return true;
}

bool Refinement::wanted(std::uint32_t edge) const { return alive(edge) && touched(edge) > tried_[edge]; }

/// The outcome that was found for the step at `place`, if it still holds. If not, the step is tried, and with it the
/// steps that come next.
Refinement::Attempt& Refinement::tried(std::span<const std::uint32_t> steps, std::size_t place) {
  const auto found = [&](std::uint32_t step) -> Attempt* {
    const auto slot = ahead_.slot_of(step);
    if (!slot) return nullptr;
    Attempt& a = attempts_[*slot];
    if (ahead_.changed_since(*slot, a.read) || ahead_.changed_since(*slot, a.trial.read())) return nullptr;
    return a.trial.met_another() ? nullptr : &a;
  };
  if (Attempt* const a = found(steps[place])) return *a;
  const std::size_t ahead = ahead_.alone() ? 1 : kAhead * team_.size();
  std::vector<std::uint32_t> batch;
  for (std::size_t i = place; i < std::min(place + ahead, steps.size()); ++i) {
    if (wanted(steps[i]) && !found(steps[i])) batch.push_back(steps[i]);
  }
  return attempts_[ahead_.run(batch, [&](std::uint32_t step, std::size_t slot) { attempt(step, attempts_[slot]); })];
}

void Refinement::attempt(std::uint32_t edge, Attempt& a) const {
  const auto h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  a.read = {mesh_.from(h), mesh_.to(h)};
  const std::optional<PatchTrial::Price> price =
      touched(edge) > priced_[edge] ? a.trial.price(BoundedMesh::edge(edge)) : prices_[edge];
  a.reached = std::numeric_limits<double>::infinity();
  a.work = 0;
  a.possible = price && price->largest <= kMostLargest && a.trial.try_collapse(*price, effort_);
  if (price && price->largest <= kMostLargest) a.reached = a.trial.reached(), a.work = a.trial.work();
  for (const Patch::Vertex& v : a.trial.patch().vertices()) a.read.push_back(v.id);
}

void Refinement::carry_out(Attempt& a) {
  ahead_.advance();
  const auto note = [&](std::uint32_t v) {
    touched_[v] = ahead_.now();
    ahead_.note_change(v);
  };
  note(a.trial.vanished());
  for (const Patch::Vertex& v : a.trial.patch().vertices()) note(v.id);
  {
    const Call::Within uninterrupted(nullptr);
    ahead_.note_change(a.trial.carry_out(mesh_));
  }
  for (const Patch::Face& f : a.trial.patch().faces()) samples_.renew(mesh_, f.id);
  for (const Coverage::Removed& r : a.trial.removed()) samples_.renew(mesh_, r.id);
}

}  // namespace tolvol
