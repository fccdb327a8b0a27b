// SPDX-License-Identifier: GPL-3.0-or-later
// Quadrics and edge order after Garland and Heckbert 1997 (area weights, boundary planes); link condition and
// connectivity by OpenMesh. A rejected position is not a rejected collapse: where the quadric's minimiser fails a
// bound, it is fitted to what the faces around it have to cover. A rejected edge waits until its two-ring changes.
#include "operation/collapse_loop.h"

#include <algorithm>
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

double squared_length(const glm::dvec3& v) { return glm::dot(v, v); }

}  // namespace

CollapseLoop::CollapseLoop(BoundedMesh& mesh) : mesh_(mesh), change_(mesh), fit_(mesh) { sum_quadrics(); }

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

void CollapseLoop::push(Edge e) {
  const std::uint32_t i = static_cast<std::uint32_t>(e.idx());
  ++stamps_[i];
  if (refused_[i]) refused_[i] = false, --refused_count_;
  if (const auto p = plan(e)) {
    const double length2 =
        squared_length(mesh_.position(mesh_.from(p->halfedge)) - mesh_.position(mesh_.to(p->halfedge)));
    heap_.push_back({p->cost + kLengthWeight * length2 * length2, i, stamps_[i]});
  }
}

void CollapseLoop::run(std::size_t target, Progress* progress) {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  // Ties go to the lower edge, so that the order is the same everywhere.
  const auto later = [](const Entry& a, const Entry& b) {
    return a.cost > b.cost || (a.cost == b.cost && a.edge > b.edge);
  };
  const std::size_t edges = connectivity.n_edges(), before = mesh_.triangle_count();
  stamps_.assign(edges, 0);
  refused_.assign(edges, false);
  heap_.clear();
  heap_.reserve(2 * edges);
  for (std::size_t i = 0; i < edges; ++i) push(Edge(static_cast<int>(i)));
  std::make_heap(heap_.begin(), heap_.end(), later);
  if (progress) progress->begin("decimating");
  while (!heap_.empty() && mesh_.triangle_count() > target) {
    if (progress) {
      progress->set_count(mesh_.triangle_count());
      progress->update(static_cast<double>(before - mesh_.triangle_count()) / static_cast<double>(before));
    }
    std::pop_heap(heap_.begin(), heap_.end(), later);
    const Entry entry = heap_.back();
    heap_.pop_back();
    const Edge e(static_cast<int>(entry.edge));
    if (entry.stamp != stamps_[entry.edge] || connectivity.status(e).deleted()) continue;
    const std::size_t sorted = heap_.size();
    collapse(e);
    for (std::size_t i = sorted; i < heap_.size(); ++i) {
      std::push_heap(heap_.begin(), heap_.begin() + static_cast<std::ptrdiff_t>(i) + 1, later);
    }
  }
}

void CollapseLoop::collapse(Edge e) {
  const std::optional<Plan> p = plan(e);
  if (!p) return;
  change_.begin();
  Halfedge h = p->halfedge;
  Outcome outcome =
      change_.try_collapse(h, p->freedom == Freedom::anywhere ? mesh_.store(p->position) : mesh_.spot(mesh_.to(h)));
  if (outcome != Outcome::possible && p->freedom == Freedom::either_way) {
    const Halfedge other = mesh_.connectivity().opposite_halfedge_handle(h);
    const Outcome second = change_.try_collapse(other, mesh_.spot(mesh_.from(h)));
    if (second == Outcome::possible) h = other;
    outcome = std::max(outcome, second);
  } else if (outcome == Outcome::refused && p->freedom == Freedom::anywhere) {
    outcome = search(h, p->position);
  }
  if (outcome == Outcome::possible) {
    const std::uint32_t v0 = mesh_.from(h), v1 = mesh_.to(h);
    mesh_.apply(change_);
    quadrics_[v1] += quadrics_[v0];
    renew(v1);
  } else if (outcome == Outcome::refused) {
    refused_[static_cast<std::size_t>(e.idx())] = true;
    ++refused_count_;
  }
}

/// Other positions for a collapse whose best one fails: fitted ones or, where there is nothing to fit to, the ends and
/// the middle.
CollapseLoop::Outcome CollapseLoop::search(Halfedge h, const glm::dvec3& best) {
  if (mesh_.bounds().forward) {
    glm::dvec3 position = best;
    bool first = true;
    for (const double hopeless : kHopeless) {
      if (!change_.prepare_collapse(h, mesh_.store(position))) return Outcome::impossible;
      if (std::exchange(first, false)) fit_.gather(change_);
      const PositionFit::Fit fit = fit_.fit(change_, position);
      if (fit.deviation > hopeless) return Outcome::refused;
      position = fit.position;
      const Outcome outcome = change_.try_collapse(h, mesh_.store(position));
      if (outcome != Outcome::refused) return outcome;
    }
    return Outcome::refused;
  }
  const Spot s0 = mesh_.spot(mesh_.from(h)), s1 = mesh_.spot(mesh_.to(h));
  for (const Spot& other : {s0, s1, mesh_.store((s0.position + s1.position) * 0.5)}) {
    const Outcome outcome = change_.try_collapse(h, other);
    if (outcome != Outcome::refused) return outcome;
  }
  return Outcome::refused;
}

void CollapseLoop::renew(std::uint32_t vertex) {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  const auto v = BoundedMesh::handle(vertex);
  for (const auto e : connectivity.ve_range(v)) push(e);
  if (refused_count_ == 0) return;
  for (const auto near : connectivity.vv_range(v)) {
    for (const auto e : connectivity.ve_range(near)) {
      const std::size_t i = static_cast<std::size_t>(e.idx());
      if (refused_[i]) push(e);
    }
  }
}

}  // namespace tolvol
