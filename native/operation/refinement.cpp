// SPDX-License-Identifier: GPL-3.0-or-later
// After the idea of alternating relocation, flips and collapses (H. Hoppe et al., "Mesh optimization", 1993), with the
// certificates of both directions instead of an energy to decide what is allowed.
#include "operation/refinement.h"

#include <algorithm>

namespace tolvol {
namespace {

constexpr int kMoves = 4;        // of one vertex in a row
constexpr int kHalvings = 3;     // of a step that does not lower the energy
constexpr double kGain = 0.999;  // a step that lowers the energy less is not taken
/// Steps of the fit from one start before a collapse is refused; with a deviation beyond this before a step, over the
/// tolerance, hardly one succeeds: without these limits collapses take four times the time and find no more.
constexpr double kHopeless[] = {2.5, 1.8, 1.5, 1.4, 1.3, 1.25, 1.2, 1.15};
constexpr int kPatience = 3;  // rounds without a collapse before the end

}  // namespace

Refinement::Refinement(BoundedMesh& mesh)
    : mesh_(mesh),
      change_(mesh),
      fit_(mesh),
      touched_(mesh.connectivity().n_vertices(), 1),
      relocated_(mesh.connectivity().n_vertices(), 0),
      flipped_(mesh.connectivity().n_edges(), 0),
      collapsed_(mesh.connectivity().n_edges(), 0) {}

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
    if (progress) {
      progress->set_count(mesh_.triangle_count());
      progress->update(0);
    }
    return mesh_.triangle_count() > target && !expired();
  };
  if (progress) progress->begin("refining");
  for (int patience = kPatience; patience > 0; --patience) {
    const std::size_t before = mesh_.triangle_count();
    for (const std::uint32_t v : vertices) {
      if (!go_on()) return;
      if (!connectivity.status(BoundedMesh::handle(v)).deleted()) relocate(v);
    }
    for (const std::uint32_t e : edges) {
      if (!go_on()) return;
      if (!connectivity.status(BoundedMesh::edge(e)).deleted()) flip(BoundedMesh::edge(e));
    }
    std::vector<std::pair<double, std::uint32_t>> order;
    for (const std::uint32_t e : edges) {
      if (!connectivity.status(BoundedMesh::edge(e)).deleted()) order.emplace_back(length2(e), e);
    }
    std::sort(order.begin(), order.end());
    edges.clear();
    for (const auto& [length, e] : order) {
      if (!go_on()) return;
      if (!connectivity.status(BoundedMesh::edge(e)).deleted()) collapse(BoundedMesh::edge(e));
      edges.push_back(e);
    }
    if (mesh_.triangle_count() < before) patience = kPatience + 1;
  }
}

void Refinement::apply() {
  ++clock_;
  for (const Change::Face& face : change_.faces()) {
    for (const std::uint32_t v : face.vertices) touched_[v] = clock_;
  }
  mesh_.apply(change_);
}

std::uint64_t Refinement::last_touched(Edge e) const {
  const Halfedge h = mesh_.connectivity().halfedge_handle(e, 0);
  return std::max(touched_[mesh_.from(h)], touched_[mesh_.to(h)]);
}

void Refinement::relocate(std::uint32_t vertex) {
  if (!mesh_.movable(vertex) || touched_[vertex] <= relocated_[vertex]) return;
  relocated_[vertex] = clock_;
  change_.begin();
  if (!change_.prepare_relocate(vertex, mesh_.spot(vertex))) return;
  // Faces around a vertex that stays count as moving: the fit is for where it could go.
  fit_.gather(change_);
  for (int move = 0; move < kMoves; ++move) {
    const glm::dvec3 from = mesh_.position(vertex);
    change_.prepare_relocate(vertex, mesh_.spot(vertex));
    const PositionFit::Fit now = fit_.fit(change_, from);
    double step = 1;
    bool moved = false;
    for (int i = 0; i < kHalvings && !moved; ++i, step *= 0.5) {
      const glm::dvec3 to = from + step * (now.position - from);
      const Spot spot = mesh_.store(to);
      if (!change_.prepare_relocate(vertex, spot)) return;
      if (!(fit_.fit(change_, spot.position).energy < kGain * now.energy)) continue;
      if (change_.check() != Change::Outcome::possible) continue;
      apply();
      moved = true;
    }
    if (!moved) break;
  }
  relocated_[vertex] = clock_;
}

void Refinement::flip(Edge e) {
  std::uint64_t& tried = flipped_[static_cast<std::size_t>(e.idx())];
  if (last_touched(e) <= tried) return;
  tried = clock_;
  change_.begin();
  if (!change_.prepare_flip(e)) return;
  fit_.gather(change_);
  const double after = fit_.fit(change_, glm::dvec3(0)).energy;
  const double before = fit_.energy_now(change_);
  if (after < kGain * before && change_.check() == Change::Outcome::possible) apply();
  tried = clock_;
}

void Refinement::collapse(Edge e) {
  std::uint64_t& tried = collapsed_[static_cast<std::size_t>(e.idx())];
  if (last_touched(e) <= tried) return;
  tried = clock_;
  change_.begin();
  const auto [freedom, h] = mesh_.merge(e);
  const Spot from = mesh_.spot(mesh_.from(h)), to = mesh_.spot(mesh_.to(h));
  constexpr auto kPossible = Change::Outcome::possible;
  bool possible = false;
  if (freedom == BoundedMesh::Freedom::anywhere) {
    for (const glm::dvec3& start : {0.5 * (from.position + to.position), from.position, to.position}) {
      possible = possible || fit_.collapse(change_, h, start, kHopeless) == kPossible;
    }
  } else if (freedom != BoundedMesh::Freedom::none) {
    possible = change_.try_collapse(h, to) == kPossible;
    if (!possible && freedom == BoundedMesh::Freedom::either_way) {
      possible = change_.try_collapse(mesh_.connectivity().opposite_halfedge_handle(h), from) == kPossible;
    }
  }
  if (possible) apply();
}

}  // namespace tolvol
