// SPDX-License-Identifier: GPL-3.0-or-later
// The idea to alternate relocations, flips and collapses is from H. Hoppe et al., "Mesh optimization", 1993. Here the
// certificates of both directions decide which steps are allowed, and not an energy.
#include "decimation/refinement.h"

#include <algorithm>
#include <optional>

#include "base/call.h"

namespace tolvol {
namespace {

/// The number of moves of one vertex in a row.
constexpr int kMoves = 4;
/// The number of lengths that are tried for a move, each half of the one before.
constexpr int kHalvings = 3;
/// A step that does not lower the energy below this share of it is not taken.
constexpr double kGain = 0.999;
/// The fit of a collapse takes so many steps from one start. It gives up before a step if the deviation, as a multiple
/// of the tolerance, is beyond the number, because hardly a collapse succeeds then. Without these limits collapses take
/// four times the time and find no more.
constexpr double kGiveUpAbove[] = {2.5, 1.8, 1.5, 1.4, 1.3, 1.25, 1.2, 1.15};
/// The number of rounds without a collapse before the end.
constexpr int kPatience = 3;
/// The number of steps that several threads try at once. More steps would come in each other's way.
constexpr std::size_t kAhead = 8;

}  // namespace

Refinement::Refinement(BoundedMesh& mesh, NewCrossings* crossings, Team& team)
    : mesh_(mesh),
      touched_(mesh.connectivity().n_vertices(), 1),
      relocated_(mesh.connectivity().n_vertices(), 0),
      flipped_(mesh.connectivity().n_edges(), 0),
      collapsed_(mesh.connectivity().n_edges(), 0) {
  // A try looks up copies, which are beyond the faces around its step.
  if (!team.alone() && !mesh.has_copies()) {
    const std::size_t vertices = mesh.connectivity().n_vertices(), edges = mesh.connectivity().n_edges();
    ahead_ = TriesAhead(team, 2 * kAhead, std::max(vertices, edges), vertices);
  }
  if (crossings) around_.emplace(mesh, *crossings, team);
  while (attempts_.size() < ahead_.slot_count()) attempts_.emplace_back(mesh, around_ ? &*around_ : nullptr);
}

void Refinement::run(std::size_t target, const std::function<bool()>& expired, Progress* progress) {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  std::vector<std::uint32_t> vertices, edges;
  for (std::uint32_t v = 0; v < connectivity.n_vertices(); ++v) {
    if (!connectivity.status(BoundedMesh::handle(v)).deleted() && !connectivity.is_isolated(BoundedMesh::handle(v)))
      vertices.push_back(v);
  }
  for (std::uint32_t e = 0; e < connectivity.n_edges(); ++e) {
    if (!connectivity.status(BoundedMesh::edge(e)).deleted()) edges.push_back(e);
  }
  const auto length2 = [&](std::uint32_t e) {
    const Halfedge h = connectivity.halfedge_handle(BoundedMesh::edge(e), 0);
    const glm::dvec3 d = mesh_.position(mesh_.from(h)) - mesh_.position(mesh_.to(h));
    return glm::dot(d, d);
  };
  const auto go_on = [&] {
    poll();
    if (progress) {
      progress->set_count(mesh_.triangle_count());
      progress->update(0);
    }
    return mesh_.triangle_count() > target && !expired();
  };
  if (progress) progress->begin("refining");
  for (int patience = kPatience; patience > 0; --patience) {
    const std::size_t before = mesh_.triangle_count();
    if (!sweep(kRelocation, vertices, go_on) || !sweep(kFlip, edges, go_on)) return;
    std::vector<std::pair<double, std::uint32_t>> order;
    for (const std::uint32_t e : edges) {
      if (!connectivity.status(BoundedMesh::edge(e)).deleted()) order.emplace_back(length2(e), e);
    }
    std::sort(order.begin(), order.end());
    edges.clear();
    for (const auto& [length, e] : order) edges.push_back(e);
    if (!sweep(kCollapse, edges, go_on)) return;
    if (mesh_.triangle_count() < before) patience = kPatience + 1;
  }
}

/// Tries all steps of a kind, in order. Returns whether it came to the end.
bool Refinement::sweep(const Kind& kind, std::span<const std::uint32_t> steps, const std::function<bool()>& go_on) {
  ahead_.drop_all();
  for (std::size_t place = 0; place < steps.size(); ++place) {
    if (!go_on()) return false;
    if ((this->*kind.wanted)(steps[place])) (this->*kind.carry_out)(steps[place], tried(kind, steps, place));
  }
  return true;
}

/// The outcome that was found for the step at `place`, if it still holds. If not, the step is tried, and with it the
/// steps that come next.
Refinement::Attempt& Refinement::tried(const Kind& kind, std::span<const std::uint32_t> steps, std::size_t place) {
  const auto found = [&](std::uint32_t step) -> Attempt* {
    if (ahead_.alone()) return nullptr;
    const auto slot = ahead_.found(step, (this->*kind.read)(step));
    if (!slot || ahead_.changed_since(*slot, attempts_[*slot].trial.read())) return nullptr;
    return attempts_[*slot].trial.met_another() ? nullptr : &attempts_[*slot];
  };
  if (Attempt* const a = found(steps[place])) return *a;
  const std::size_t ahead = ahead_.alone() ? 1 : kAhead;
  std::vector<std::uint32_t> batch;
  for (std::size_t i = place; i < std::min(place + ahead, steps.size()); ++i) {
    if ((this->*kind.wanted)(steps[i]) && !found(steps[i])) batch.push_back(steps[i]);
  }
  return attempts_[ahead_.run(
      batch, [&](std::uint32_t step, std::size_t slot) { (this->*kind.attempt)(step, attempts_[slot]); })];
}

void Refinement::apply(Attempt& a) {
  ahead_.advance();
  for (const Change::Face& face : a.trial.change().faces()) {
    for (const std::uint32_t v : face.vertices) {
      touched_[v] = ahead_.now();
      ahead_.note_change(v);
    }
  }
  ahead_.note_change(a.trial.carry_out(mesh_));
  // A vertex that stays where it was has another share, distance and boundary, though its other faces are the same.
  const std::optional<std::uint32_t> kept = a.trial.change().vertex();
  if (!kept) return;
  ahead_.note_change(*kept);
  for (const auto v : mesh_.connectivity().vv_range(BoundedMesh::handle(*kept))) {
    ahead_.note_change(static_cast<std::uint32_t>(v.idx()));
  }
}

bool Refinement::relocation_wanted(std::uint32_t vertex) const {
  return !mesh_.connectivity().status(BoundedMesh::handle(vertex)).deleted() && mesh_.movable(vertex) &&
         touched_[vertex] > relocated_[vertex];
}

void Refinement::try_relocation(std::uint32_t vertex, Attempt& a) const {
  a.trial.begin();
  // Faces around a vertex that stays count as moving, because the fit is for the place where it could go.
  a.possible = a.trial.prepare_relocate(vertex, mesh_.vertex_position(vertex));
  if (!a.possible) return;
  a.fit.gather(a.trial.change());
  a.possible = find_move(vertex, a);
}

/// Tries one step towards the place where the vertex fits best.
bool Refinement::find_move(std::uint32_t vertex, Attempt& a) const {
  const glm::dvec3 from = mesh_.position(vertex);
  a.trial.prepare_relocate(vertex, mesh_.vertex_position(vertex));
  const PositionFit::Fit now = a.fit.fit(a.trial.change(), from);
  double step = 1;
  for (int i = 0; i < kHalvings; ++i, step *= 0.5) {
    const VertexPosition target = mesh_.store(from + step * (now.position - from));
    if (!a.trial.prepare_relocate(vertex, target)) return false;
    if (!(a.fit.fit(a.trial.change(), target.position).energy < kGain * now.energy)) continue;
    if (a.trial.check() == ChangeTrial::Outcome::possible) return true;
  }
  return false;
}

void Refinement::relocate(std::uint32_t vertex, Attempt& a) {
  for (int moves = 1; a.possible; ++moves) {
    apply(a);
    a.possible = moves < kMoves && find_move(vertex, a);
  }
  relocated_[vertex] = ahead_.now();
}

std::uint64_t Refinement::at_ends(const std::vector<std::uint64_t>& times, std::uint32_t edge) const {
  const Halfedge h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  return std::max(times[mesh_.from(h)], times[mesh_.to(h)]);
}

Refinement::Read Refinement::read_at_ends(std::uint32_t edge) const {
  const Halfedge h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  const std::uint32_t from = mesh_.from(h), to = mesh_.to(h);
  return {from, to, from, to};
}

/// Reads at the other diagonal as well: an edge may have come there.
Refinement::Read Refinement::read_at_diagonals(std::uint32_t edge) const {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  Read read = read_at_ends(edge);
  for (unsigned side = 0; side < 2; ++side) {
    const Halfedge h = connectivity.halfedge_handle(BoundedMesh::edge(edge), side);
    if (!connectivity.is_boundary(h)) read[2 + side] = mesh_.to(connectivity.next_halfedge_handle(h));
  }
  return read;
}

bool Refinement::flip_wanted(std::uint32_t edge) const {
  return !mesh_.connectivity().status(BoundedMesh::edge(edge)).deleted() && at_ends(touched_, edge) > flipped_[edge];
}

void Refinement::try_flip(std::uint32_t edge, Attempt& a) const {
  a.trial.begin();
  a.possible = a.trial.prepare_flip(BoundedMesh::edge(edge));
  if (!a.possible) return;
  a.fit.gather(a.trial.change());
  const double after = a.fit.fit(a.trial.change(), glm::dvec3(0)).energy;
  const double before = a.fit.energy_now(a.trial.change());
  a.possible = after < kGain * before && a.trial.check() == ChangeTrial::Outcome::possible;
}

void Refinement::flip(std::uint32_t edge, Attempt& a) {
  if (a.possible) apply(a);
  flipped_[edge] = ahead_.now();
}

bool Refinement::collapse_wanted(std::uint32_t edge) const {
  return !mesh_.connectivity().status(BoundedMesh::edge(edge)).deleted() && at_ends(touched_, edge) > collapsed_[edge];
}

void Refinement::try_collapse(std::uint32_t edge, Attempt& a) const {
  constexpr auto kPossible = ChangeTrial::Outcome::possible;
  a.trial.begin();
  a.possible = false;
  const auto [freedom, h] = mesh_.merge(BoundedMesh::edge(edge));
  const VertexPosition from = mesh_.vertex_position(mesh_.from(h)), to = mesh_.vertex_position(mesh_.to(h));
  if (freedom == BoundedMesh::Freedom::anywhere) {
    for (const glm::dvec3& start : {0.5 * (from.position + to.position), from.position, to.position}) {
      a.possible = a.possible || a.fit.collapse(a.trial, h, start, kGiveUpAbove) == kPossible;
    }
  } else if (freedom != BoundedMesh::Freedom::none) {
    a.possible = a.trial.try_collapse(h, to) == kPossible;
    if (!a.possible && freedom == BoundedMesh::Freedom::either_way) {
      a.possible = a.trial.try_collapse(mesh_.connectivity().opposite_halfedge_handle(h), from) == kPossible;
    }
  }
}

void Refinement::collapse(std::uint32_t edge, Attempt& a) {
  collapsed_[edge] = ahead_.now();
  if (a.possible) apply(a);
}

}  // namespace tolvol
