// SPDX-License-Identifier: GPL-3.0-or-later
// Quadrics and edge order after Garland and Heckbert 1997 (area weights, boundary planes); link condition and
// connectivity by OpenMesh. A rejected position is not a rejected collapse: where the quadric's minimiser fails a
// bound, it is fitted to what the faces around it have to cover. A rejected edge waits until its two-ring changes.
#include "operation/collapse_loop.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace tolvol {
namespace {

constexpr double kBoundaryWeight = 10;  // of a boundary edge's plane, times its squared length
constexpr double kReach = 2;            // a minimiser is trusted within this many edge lengths of the edge's middle
/// Steps of the fit before a collapse is refused; with a deviation beyond this before a step, over the tolerance,
/// hardly one in fifty still succeeds.
constexpr double kHopeless[] = {1.4, 1.2, 1.12};
/// Where many collapses cost nothing, on a plate, short edges go first: a weight of the fourth power of the length,
/// which has the quadrics' unit. Without it one vertex would sweep along a row and leave needles behind.
constexpr double kLengthWeight = 1e-6;
// Edges tried at once: one for so many triangles, because collapses come in each other's way, and at most so many.
constexpr std::size_t kTrianglesPerAttempt = 48, kMostAttempts = 64;
constexpr unsigned kMostThreads = 16;  // more would wait for each other
constexpr double kNever = std::numeric_limits<double>::infinity();

double squared_length(const glm::dvec3& v) { return glm::dot(v, v); }

}  // namespace

CollapseLoop::CollapseLoop(BoundedMesh& mesh, unsigned threads)
    : mesh_(mesh),
      // A rival answers one question after another, and copies are looked up beyond the faces around an edge.
      team_(mesh.bounds().rival || mesh.has_copies() ? 1 : std::min(thread_count(threads), kMostThreads)),
      queue_(mesh.connectivity().n_edges()),
      attempt_of_(mesh.connectivity().n_edges(), 0),
      touched_(mesh.connectivity().n_vertices(), 0),
      refused_(mesh.connectivity().n_edges(), false) {
  // Those of the last time, too, may still be waiting for their turn.
  const std::size_t attempts = team_.alone() ? 1 : 2 * kMostAttempts;
  for (std::size_t i = 0; i < attempts; ++i) attempts_.emplace_back(mesh);
  sum_quadrics();
}

void CollapseLoop::sum_quadrics() {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  quadrics_.assign(connectivity.n_vertices(), Quadric());
  for (std::uint32_t i = 0; i < connectivity.n_faces(); ++i) {
    const glm::uvec3& t = mesh_.triangle(i);
    const glm::dvec3 &a = mesh_.position(t.x), &b = mesh_.position(t.y), &c = mesh_.position(t.z);
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double length = glm::length(normal);
    if (!(length > 0)) continue;  // a degenerate face has no plane
    const glm::dvec3 unit = normal / length;
    const Quadric q(unit, -glm::dot(unit, a), 0.5 * length);
    for (int k = 0; k < 3; ++k) quadrics_[t[k]] += q;
  }
  for (const auto h : connectivity.halfedges()) {
    if (!connectivity.is_boundary(h)) continue;
    const glm::uvec3& t = mesh_.triangle(static_cast<std::uint32_t>(connectivity.opposite_face_handle(h).idx()));
    const glm::dvec3 &a = mesh_.position(mesh_.from(h)), &b = mesh_.position(mesh_.to(h)), edge = b - a;
    const glm::dvec3 face =
        glm::cross(mesh_.position(t.y) - mesh_.position(t.x), mesh_.position(t.z) - mesh_.position(t.x));
    const glm::dvec3 normal = glm::cross(edge, face);
    const double length = glm::length(normal);
    if (!(length > 0)) continue;
    const glm::dvec3 unit = normal / length;
    const Quadric q(unit, -glm::dot(unit, a), kBoundaryWeight * squared_length(edge));
    quadrics_[mesh_.from(h)] += q, quadrics_[mesh_.to(h)] += q;
  }
}

CollapseLoop::Plan CollapseLoop::free_plan(Halfedge h) const {
  const std::uint32_t v0 = mesh_.from(h), v1 = mesh_.to(h);
  const Quadric q = quadrics_[v0] + quadrics_[v1];
  const glm::dvec3 &p0 = mesh_.position(v0), &p1 = mesh_.position(v1), middle = (p0 + p1) * 0.5;
  const double cost0 = q(p0), cost1 = q(p1), cost_middle = q(middle);
  glm::dvec3 best = p0;
  double cost = cost0;
  if (cost1 < cost) best = p1, cost = cost1;
  if (cost_middle < cost) best = middle, cost = cost_middle;
  if (const auto minimiser = q.minimiser()) {
    const double reach2 = kReach * kReach * squared_length(p1 - p0);
    const double cost_minimiser = q(*minimiser);
    if (squared_length(*minimiser - middle) <= reach2 && cost_minimiser <= cost)
      best = *minimiser, cost = cost_minimiser;
  }
  return {h, best, cost, Freedom::anywhere};
}

std::optional<CollapseLoop::Plan> CollapseLoop::plan(Edge e) const {
  auto [freedom, h] = mesh_.merge(e);
  if (freedom == Freedom::none) return std::nullopt;
  if (freedom == Freedom::anywhere) return free_plan(h);
  const Quadric q = quadrics_[mesh_.from(h)] + quadrics_[mesh_.to(h)];
  const double cost0 = q(mesh_.position(mesh_.from(h))), cost1 = q(mesh_.position(mesh_.to(h)));
  const bool keep0 = freedom == Freedom::either_way && cost0 < cost1;
  if (keep0) h = mesh_.connectivity().opposite_halfedge_handle(h);
  return Plan{h, mesh_.position(mesh_.to(h)), keep0 ? cost0 : cost1, freedom};
}

double CollapseLoop::cost(Edge e) const {
  const auto p = plan(e);
  if (!p) return kNever;
  const double length2 =
      squared_length(mesh_.position(mesh_.from(p->halfedge)) - mesh_.position(mesh_.to(p->halfedge)));
  return p->cost + kLengthWeight * length2 * length2;
}

void CollapseLoop::push(std::uint32_t edge, double cost) {
  if (cost < kNever) {
    queue_.push(edge, cost);
  } else {
    queue_.drop(edge);
  }
}

void CollapseLoop::run(std::size_t target, Progress* progress) {
  constexpr std::size_t kBlock = 1024;
  const std::size_t before = mesh_.triangle_count();
  std::vector<double> costs(mesh_.connectivity().n_edges());
  team_.run(costs.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) costs[i] = cost(Edge(static_cast<int>(i)));
  });
  for (std::uint32_t i = 0; i < costs.size(); ++i) push(i, costs[i]);
  if (progress) progress->begin("decimating");
  while (mesh_.triangle_count() > target) {
    if (progress) {
      progress->set_count(mesh_.triangle_count());
      progress->update(static_cast<double>(before - mesh_.triangle_count()) / static_cast<double>(before));
    }
    const auto entry = queue_.pop();
    if (!entry) break;
    if (mesh_.connectivity().status(BoundedMesh::edge(entry->edge)).deleted()) continue;
    Attempt* const tried = found(entry->edge);
    carry_out(tried ? *tried : try_ahead(entry->edge));
  }
}

/// What was found for the edge, if that still holds.
CollapseLoop::Attempt* CollapseLoop::found(std::uint32_t edge) {
  Attempt& a = attempts_[attempt_of_[edge]];
  if (a.edge != edge) return nullptr;
  const Halfedge h = mesh_.connectivity().halfedge_handle(BoundedMesh::edge(edge), 0);
  return std::max(touched_[mesh_.from(h)], touched_[mesh_.to(h)]) <= a.at ? &a : nullptr;
}

/// Tries the edge and, with several threads, those that would come next.
CollapseLoop::Attempt& CollapseLoop::try_ahead(std::uint32_t edge) {
  const auto take = [&](std::uint32_t e) -> Attempt& {
    attempt_of_[e] = static_cast<std::uint32_t>(next_);
    Attempt& a = attempts_[next_];
    next_ = (next_ + 1) % attempts_.size();
    a.edge = e, a.at = clock_;
    return a;
  };
  Attempt& first = take(edge);
  if (team_.alone()) {
    attempt(first);
    return first;
  }
  const std::size_t most = std::clamp<std::size_t>(mesh_.triangle_count() / kTrianglesPerAttempt, 1, kMostAttempts);
  std::vector<Attempt*> batch{&first};
  std::vector<CollapseQueue::Entry> ahead;
  while (ahead.size() + 1 < most) {
    const auto entry = queue_.pop();
    if (!entry) break;
    if (mesh_.connectivity().status(BoundedMesh::edge(entry->edge)).deleted()) continue;
    ahead.push_back(*entry);
    if (!found(entry->edge)) batch.push_back(&take(entry->edge));
  }
  for (const CollapseQueue::Entry& entry : ahead) queue_.push(entry.edge, entry.cost);
  team_.run(batch.size(), 1, [&](std::size_t i, std::size_t) { attempt(*batch[i]); });
  return first;
}

void CollapseLoop::carry_out(Attempt& a) {
  const std::uint32_t edge = std::exchange(a.edge, kNoEdge);
  if (a.outcome == Outcome::possible) {
    const std::uint32_t v0 = mesh_.from(a.halfedge), v1 = mesh_.to(a.halfedge);
    mesh_.apply(a.change);
    quadrics_[v1] += quadrics_[v0];
    renew_around(v1);
  } else if (a.outcome == Outcome::refused) {
    refused_[edge] = true;
    ++refused_count_;
  }
}

/// Reads faces around the edge's two ends, and nothing else of the mesh that changes.
void CollapseLoop::attempt(Attempt& a) const {
  a.outcome = Outcome::impossible;
  const std::optional<Plan> p = plan(BoundedMesh::edge(a.edge));
  if (!p) return;
  a.change.begin();
  a.halfedge = p->halfedge;
  const Halfedge h = a.halfedge;
  a.outcome =
      a.change.try_collapse(h, p->freedom == Freedom::anywhere ? mesh_.store(p->position) : mesh_.spot(mesh_.to(h)));
  if (a.outcome != Outcome::possible && p->freedom == Freedom::either_way) {
    const Halfedge other = mesh_.connectivity().opposite_halfedge_handle(h);
    const Outcome second = a.change.try_collapse(other, mesh_.spot(mesh_.from(h)));
    if (second == Outcome::possible) a.halfedge = other;
    a.outcome = std::max(a.outcome, second);
  } else if (a.outcome == Outcome::refused && p->freedom == Freedom::anywhere) {
    a.outcome = search(a, p->position);
  }
}

/// Other positions for a collapse whose best one fails: fitted ones or, where there is nothing to fit to, the ends and
/// the middle.
CollapseLoop::Outcome CollapseLoop::search(Attempt& a, const glm::dvec3& best) const {
  const Halfedge h = a.halfedge;
  if (mesh_.bounds().forward) {
    glm::dvec3 position = best;
    bool first = true;
    for (const double hopeless : kHopeless) {
      if (!a.change.prepare_collapse(h, mesh_.store(position))) return Outcome::impossible;
      if (std::exchange(first, false)) a.fit.gather(a.change);
      const PositionFit::Fit fit = a.fit.fit(a.change, position);
      if (fit.deviation > hopeless) return Outcome::refused;
      position = fit.position;
      const Outcome outcome = a.change.try_collapse(h, mesh_.store(position));
      if (outcome != Outcome::refused) return outcome;
    }
    return Outcome::refused;
  }
  const Spot s0 = mesh_.spot(mesh_.from(h)), s1 = mesh_.spot(mesh_.to(h));
  for (const Spot& other : {s0, s1, mesh_.store((s0.position + s1.position) * 0.5)}) {
    const Outcome outcome = a.change.try_collapse(h, other);
    if (outcome != Outcome::refused) return outcome;
  }
  return Outcome::refused;
}

/// After a collapse: the costs that it changes, and the edges that may now be possible.
void CollapseLoop::renew_around(std::uint32_t vertex) {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  const auto v = BoundedMesh::handle(vertex);
  const auto renew = [&](Edge e) {
    const std::uint32_t i = static_cast<std::uint32_t>(e.idx());
    if (refused_[i]) refused_[i] = false, --refused_count_;
    push(i, cost(e));
  };
  touched_[vertex] = ++clock_;
  for (const auto e : connectivity.ve_range(v)) renew(e);
  for (const auto near : connectivity.vv_range(v)) {
    touched_[static_cast<std::size_t>(near.idx())] = clock_;
    if (refused_count_ == 0) continue;
    for (const auto e : connectivity.ve_range(near)) {
      if (refused_[static_cast<std::size_t>(e.idx())]) renew(e);
    }
  }
}

}  // namespace tolvol
