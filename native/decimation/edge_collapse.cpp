// SPDX-License-Identifier: GPL-3.0-or-later
// Quadrics and the order of edges are those of Garland and Heckbert 1997, with area weights and boundary planes. A
// position that is refused is not yet a collapse that is refused: where the quadric's minimiser fails a bound, the
// position is fitted to the pieces that the faces around it have to cover.
#include "decimation/edge_collapse.h"

#include <algorithm>
#include <array>

#include "base/call.h"
#include "geometry/lengths.h"

namespace tolvol {
namespace {

/// The weight of a boundary edge's plane for each unit of its squared length.
constexpr double kBoundaryWeight = 10;
/// A minimiser is trusted within so many edge lengths of the edge's middle.
constexpr double kReach = 2;
/// The fit takes at most as many steps as there are numbers here. It gives up in step i if the deviation before the
/// step is beyond number i, in tolerances, because from there hardly one collapse in fifty succeeds.
constexpr double kGiveUpFitAbove[] = {1.4, 1.2, 1.12};
/// The weight of the fourth power of an edge's length, which has the quadrics' unit. It lets short edges go first where
/// many collapses cost nothing, as on a plate. Without it one vertex would sweep along a row and leave needles behind.
constexpr double kLengthWeight = 1e-6;

double length_cost(const glm::dvec3& a, const glm::dvec3& b) {
  const double length2 = squared_length(b - a);
  return kLengthWeight * length2 * length2;
}

}  // namespace

EdgeCollapse::EdgeCollapse(BoundedMesh& mesh, Team& team) : mesh_(mesh) { sum_quadrics(team); }

void EdgeCollapse::sum_quadrics(Team& team) {
  const std::size_t count = mesh_.connectivity().n_vertices(), ranges = team.size();
  quadrics_.assign(count, Quadric());
  team.run(ranges, 1, [&](std::size_t i, std::size_t) {
    sum_quadrics_of(static_cast<std::uint32_t>(count * i / ranges),
                    static_cast<std::uint32_t>(count * (i + 1) / ranges));
  });
}

/// Sums the quadrics of the vertices from `first` to before `last`. Every thread looks at all faces and adds only to
/// vertices of its own range, so that each vertex sums in the order of the faces.
void EdgeCollapse::sum_quadrics_of(std::uint32_t first, std::uint32_t last) {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  const auto is_in_range = [&](std::uint32_t v) { return first <= v && v < last; };
  for (std::uint32_t i = 0; i < connectivity.n_faces(); ++i) {
    poll_at(i);
    if (!mesh_.alive(i)) continue;
    const glm::uvec3& t = mesh_.triangle(i);
    if (!is_in_range(t.x) && !is_in_range(t.y) && !is_in_range(t.z)) continue;
    const glm::dvec3 &a = mesh_.position(t.x), &b = mesh_.position(t.y), &c = mesh_.position(t.z);
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double length = glm::length(normal);
    if (!(length > 0)) continue;  // A degenerate face has no plane.
    const glm::dvec3 unit = normal / length;
    const Quadric q(unit, -glm::dot(unit, a), 0.5 * length);
    for (int k = 0; k < 3; ++k) {
      if (is_in_range(t[k])) quadrics_[t[k]] += q;
    }
  }
  for (const auto h : connectivity.halfedges()) {
    poll_at(static_cast<std::size_t>(h.idx()));
    if (connectivity.status(h).deleted() || !connectivity.is_boundary(h)) continue;
    if (!is_in_range(mesh_.from(h)) && !is_in_range(mesh_.to(h))) continue;
    const glm::uvec3& t = mesh_.triangle(static_cast<std::uint32_t>(connectivity.opposite_face_handle(h).idx()));
    const glm::dvec3 &a = mesh_.position(mesh_.from(h)), &b = mesh_.position(mesh_.to(h)), edge = b - a;
    const glm::dvec3 face =
        glm::cross(mesh_.position(t.y) - mesh_.position(t.x), mesh_.position(t.z) - mesh_.position(t.x));
    const glm::dvec3 normal = glm::cross(edge, face);
    const double length = glm::length(normal);
    if (!(length > 0)) continue;
    const glm::dvec3 unit = normal / length;
    const Quadric q(unit, -glm::dot(unit, a), kBoundaryWeight * squared_length(edge));
    for (const std::uint32_t v : {mesh_.from(h), mesh_.to(h)}) {
      if (is_in_range(v)) quadrics_[v] += q;
    }
  }
}

EdgeCollapse::Plan EdgeCollapse::free_plan(Halfedge h) const {
  const std::uint32_t v0 = mesh_.from(h), v1 = mesh_.to(h);
  const Quadric q = quadric_of_copies(v0) + quadric_of_copies(v1);
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

std::optional<EdgeCollapse::Plan> EdgeCollapse::plan(Edge e) const {
  auto [freedom, h] = mesh_.merge(e);
  if (freedom == Freedom::none) return std::nullopt;
  if (freedom == Freedom::anywhere) return free_plan(h);
  const Quadric q = quadric_of_copies(mesh_.from(h)) + quadric_of_copies(mesh_.to(h));
  const double cost0 = q(mesh_.position(mesh_.from(h))), cost1 = q(mesh_.position(mesh_.to(h)));
  const bool keep0 = freedom == Freedom::either_way && cost0 < cost1;
  if (keep0) h = mesh_.connectivity().opposite_halfedge_handle(h);
  return Plan{h, mesh_.position(mesh_.to(h)), keep0 ? cost0 : cost1, freedom};
}

Quadric EdgeCollapse::quadric_of_copies(std::uint32_t vertex) const {
  if (!mesh_.joined(vertex)) return quadrics_[vertex];
  Quadric sum;
  for (const std::uint32_t copy : mesh_.copies(vertex)) sum += quadrics_[copy];
  return sum;
}

double EdgeCollapse::cost(std::uint32_t edge) const {
  const auto p = plan(BoundedMesh::edge(edge));
  if (!p) return kNever;
  return p->cost + length_cost(mesh_.position(mesh_.from(p->halfedge)), mesh_.position(mesh_.to(p->halfedge)));
}

void EdgeCollapse::attempt(std::uint32_t edge, Attempt& a) const {
  a.outcome = Outcome::impossible, a.spared = false;
  a.trial.begin(), a.fit.begin();
  const std::optional<Plan> p = plan(BoundedMesh::edge(edge));
  if (!p) return;
  a.halfedge = p->halfedge;
  const Halfedge h = a.halfedge;
  a.outcome = a.trial.try_collapse(
      h, p->freedom == Freedom::anywhere ? mesh_.store(p->position) : mesh_.vertex_position(mesh_.to(h)));
  if (a.outcome != Outcome::possible && p->freedom == Freedom::either_way) {
    const Halfedge other = mesh_.connectivity().opposite_halfedge_handle(h);
    const Outcome second = a.trial.try_collapse(other, mesh_.vertex_position(mesh_.from(h)));
    if (second == Outcome::possible) a.halfedge = other;
    a.outcome = std::max(a.outcome, second);
  } else if (a.outcome == Outcome::refused && p->freedom == Freedom::anywhere &&
             a.trial.proof() == ChangeTrial::Proof::now) {
    a.outcome = search(a, p->position);
  }
}

/// Tries other positions for a collapse whose best position fails: an end that costs nothing either, as on a plane,
/// then fitted positions, then the ends that cost something, and where sheets meet the middle, because what the fit
/// sees of them pulls to several sides. Where there is nothing to fit to, it tries the ends and the middle. Where the
/// best position costs nothing, a position off the planes would spoil them for the collapses to come: the edge is
/// spared, and waits until it is to be tried at any cost.
EdgeCollapse::Outcome EdgeCollapse::search(Attempt& a, const glm::dvec3& best) const {
  const Halfedge h = a.halfedge;
  const VertexPosition s0 = mesh_.vertex_position(mesh_.from(h)), s1 = mesh_.vertex_position(mesh_.to(h));
  if (mesh_.certified()) {
    const Quadric q = quadric_of_copies(mesh_.from(h)) + quadric_of_copies(mesh_.to(h));
    const double nothing = length_cost(s0.position, s1.position);
    const auto possible_at_end = [&](bool that_costs) {
      return std::ranges::any_of(std::array{s0, s1}, [&](const VertexPosition& end) {
        return end.position != best && (q(end.position) > nothing) == that_costs &&
               a.trial.try_collapse(h, end) == Outcome::possible;
      });
    };
    if (possible_at_end(false)) return Outcome::possible;
    a.spared = q(best) <= nothing && !a.at_any_cost;
    if (a.spared) return Outcome::refused;
    const Outcome fitted = a.fit.collapse(a.trial, h, best, kGiveUpFitAbove);
    if (fitted != Outcome::refused) return fitted;
    if (possible_at_end(true)) return Outcome::possible;
    if (!mesh_.joined(mesh_.to(h))) return Outcome::refused;
    return a.trial.try_collapse(h, mesh_.store((s0.position + s1.position) * 0.5));
  }
  for (const VertexPosition& other : {s0, s1, mesh_.store((s0.position + s1.position) * 0.5)}) {
    const Outcome outcome = a.trial.try_collapse(h, other);
    if (outcome != Outcome::refused) return outcome;
  }
  return Outcome::refused;
}

EdgeCollapse::Carried EdgeCollapse::carry_out(Attempt& a) {
  for (const Halfedge h : a.trial.change().collapses()) quadrics_[mesh_.to(h)] += quadrics_[mesh_.from(h)];
  const std::uint32_t kept = mesh_.to(a.halfedge);
  return {kept, a.trial.carry_out(mesh_)};
}

}  // namespace tolvol
