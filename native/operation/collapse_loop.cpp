// SPDX-License-Identifier: GPL-3.0-or-later
// Quadrics and edge order after Garland and Heckbert 1997 (area weights, boundary planes); link condition and
// connectivity by OpenMesh. A rejected position is not a rejected collapse: where the quadric's minimiser fails a
// bound, a few others are tried. A rejected edge waits until its two-ring changes.
#include "operation/collapse_loop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "reference/errors.h"

namespace tolvol {
namespace {

constexpr double kBoundaryWeight = 10;  // of a boundary edge's plane, times its squared length
constexpr double kFoldCosine = 0.2;     // a face's normal turns by less than acos of this
constexpr double kReach = 2;            // a minimiser is trusted within this many edge lengths of the edge's middle
constexpr int kTries = 8;               // positions strewn around the best one when it fails,
constexpr double kSpread = 0.3, kWideSpread = 0.6;  // within these shares of the tolerance along each axis, in turn
/// Where many collapses cost nothing, on a plate, short edges go first: a weight of the fourth power of the length,
/// which has the quadrics' unit. Without it one vertex would sweep along a row and leave needles behind.
constexpr double kLengthWeight = 1e-6;

double squared_length(const glm::dvec3& v) { return glm::dot(v, v); }

}  // namespace

CollapseLoop::CollapseLoop(CollapseInput input, const CollapseBounds& bounds)
    : bounds_(bounds),
      subset_(input.subset),
      store_(std::move(input.store)),
      triangles_(std::move(input.triangles)),
      pinned_(std::move(input.pinned)),
      slots_(std::move(input.slots)),
      wedges_(std::move(input.wedges)) {
  for (const Spot& s : input.spots) positions_.push_back(s.position), stored_.push_back(s.stored);
  build(input.on_reference);
}

void CollapseLoop::build(bool on_reference) {
  mesh_.request_vertex_status();
  mesh_.request_edge_status();
  mesh_.request_halfedge_status();
  mesh_.request_face_status();
  const std::size_t n = positions_.size(), m = triangles_.size();
  mesh_.reserve(static_cast<unsigned>(n), static_cast<unsigned>(3 * m / 2 + n), static_cast<unsigned>(m));
  for (std::size_t i = 0; i < n; ++i) mesh_.new_vertex();
  for (const glm::uvec3& t : triangles_) {
    const OpenMesh::VertexHandle corners[3] = {OpenMesh::VertexHandle(static_cast<int>(t.x)),
                                               OpenMesh::VertexHandle(static_cast<int>(t.y)),
                                               OpenMesh::VertexHandle(static_cast<int>(t.z))};
    if (!mesh_.add_face(corners, 3).is_valid()) throw std::logic_error("the cut mesh is not a manifold");
  }
  triangle_count_ = m;
  for (std::uint32_t v = 0; v < n; ++v) {
    if (slots_[v] != v) copies_.try_emplace(slots_[v], 1, slots_[v]).first->second.push_back(v);
  }
  moved_.assign(n, false);
  seam_.assign(n, false);
  merged_into_.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) merged_into_[i] = i;
  corner_source_.resize(m);
  for (std::uint32_t i = 0; i < m; ++i) corner_source_[i] = {3 * i, 3 * i + 1, 3 * i + 2};
  if (!wedges_.empty()) {
    std::vector<std::uint32_t> first(n, Coverage::kNone);
    for (std::size_t i = 0; i < m; ++i) {
      for (int k = 0; k < 3; ++k) {
        std::uint32_t& wedge = first[triangles_[i][k]];
        if (wedge == Coverage::kNone) wedge = wedges_[i][k];
        if (wedge != wedges_[i][k]) seam_[triangles_[i][k]] = true;
      }
    }
  }
  quadrics_.assign(n, Quadric());
  for (const glm::uvec3& t : triangles_) {
    const glm::dvec3 &a = positions_[t.x], &b = positions_[t.y], &c = positions_[t.z];
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double length = glm::length(normal);
    if (!(length > 0)) continue;  // a degenerate face has no plane
    const glm::dvec3 unit = normal / length;
    const Quadric q(unit, -glm::dot(unit, a), 0.5 * length);
    for (int k = 0; k < 3; ++k) quadrics_[t[k]] += q;
  }
  for (const auto h : mesh_.halfedges()) {
    if (!mesh_.is_boundary(h)) continue;
    const glm::uvec3& t = triangles_[static_cast<std::size_t>(mesh_.opposite_face_handle(h).idx())];
    const glm::dvec3 &a = positions_[from(h)], &b = positions_[to(h)], edge = b - a;
    const glm::dvec3 face = glm::cross(positions_[t.y] - positions_[t.x], positions_[t.z] - positions_[t.x]);
    const glm::dvec3 normal = glm::cross(edge, face);
    const double length = glm::length(normal);
    if (!(length > 0)) continue;
    const glm::dvec3 unit = normal / length;
    const Quadric q(unit, -glm::dot(unit, a), kBoundaryWeight * squared_length(edge));
    quadrics_[from(h)] += q, quadrics_[to(h)] += q;
  }
  distance_.assign(n, 0);
  if (bounds_.forward) {
    for (std::size_t i = 0; i < n && !on_reference; ++i) distance_[i] = bounds_.forward->distance_bound(positions_[i]);
    face_distance_.assign(m, on_reference ? 0 : TriangleCertificate::kUnproved);
  }
}

std::uint32_t CollapseLoop::survivor(std::uint32_t v) const {
  while (merged_into_[v] != v) v = merged_into_[v] = merged_into_[merged_into_[v]];
  return v;
}

CollapseLoop::Plan CollapseLoop::free_plan(Halfedge h) const {
  const std::uint32_t v0 = from(h), v1 = to(h);
  const Quadric q = quadrics_[v0] + quadrics_[v1];
  const glm::dvec3 &p0 = positions_[v0], &p1 = positions_[v1], middle = (p0 + p1) * 0.5;
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

/// A vertex of higher rank can only be the one that stays.
int CollapseLoop::rank(std::uint32_t vertex) const {
  return pinned_[vertex] ? 4 : (seam_[vertex] ? 2 : 0) + (on_boundary(vertex) ? 1 : 0);
}

std::optional<CollapseLoop::Plan> CollapseLoop::plan(Edge e) const {
  Halfedge h = mesh_.halfedge_handle(e, 0);
  const std::uint32_t v0 = from(h), v1 = to(h);
  if (pinned_[v0] && pinned_[v1]) return std::nullopt;
  const int rank0 = rank(v0), rank1 = rank(v1);
  // A boundary vertex never leaves the boundary, not even for a vertex that must stay.
  if (rank0 > rank1 && on_boundary(v1) && !on_boundary(v0)) return std::nullopt;
  if (rank1 > rank0 && on_boundary(v0) && !on_boundary(v1)) return std::nullopt;
  const bool either = rank0 == rank1;
  if (either && !subset_ && !seam_[v0]) return free_plan(h);
  const Quadric q = quadrics_[v0] + quadrics_[v1];
  const double cost0 = q(positions_[v0]), cost1 = q(positions_[v1]);
  const bool keep0 = either ? cost0 < cost1 : rank0 > rank1;
  if (keep0) h = mesh_.opposite_halfedge_handle(h);
  return Plan{h, positions_[to(h)], keep0 ? cost0 : cost1, either ? Freedom::either_way : Freedom::one_way};
}

void CollapseLoop::push(Edge e) {
  const std::uint32_t i = static_cast<std::uint32_t>(e.idx());
  ++stamps_[i];
  if (refused_[i]) refused_[i] = false, --refused_count_;
  if (const auto p = plan(e)) {
    const double length2 = squared_length(positions_[from(p->halfedge)] - positions_[to(p->halfedge)]);
    heap_.push_back({p->cost + kLengthWeight * length2 * length2, i, stamps_[i]});
  }
}

void CollapseLoop::run(std::size_t target, Progress* progress) {
  // Ties go to the lower edge, so that the order is the same everywhere.
  const auto later = [](const Entry& a, const Entry& b) {
    return a.cost > b.cost || (a.cost == b.cost && a.edge > b.edge);
  };
  const std::size_t edges = mesh_.n_edges(), before = triangle_count_;
  stamps_.assign(edges, 0);
  refused_.assign(edges, false);
  heap_.clear();
  heap_.reserve(2 * edges);
  for (std::size_t i = 0; i < edges; ++i) push(Edge(static_cast<int>(i)));
  std::make_heap(heap_.begin(), heap_.end(), later);
  if (progress) progress->begin("decimating");
  while (!heap_.empty() && triangle_count_ > target) {
    if (progress) {
      progress->set_count(triangle_count_);
      progress->update(static_cast<double>(before - triangle_count_) / static_cast<double>(before));
    }
    std::pop_heap(heap_.begin(), heap_.end(), later);
    const Entry entry = heap_.back();
    heap_.pop_back();
    const Edge e(static_cast<int>(entry.edge));
    if (entry.stamp != stamps_[entry.edge] || mesh_.status(e).deleted()) continue;
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
  const Halfedge h = p->halfedge;
  Outcome outcome = attempt(h, p->freedom == Freedom::anywhere ? store_(p->position) : spot(to(h)));
  if (outcome != Outcome::done && p->freedom == Freedom::either_way) {
    outcome = std::max(outcome, attempt(mesh_.opposite_halfedge_handle(h), spot(from(h))));
  } else if (outcome == Outcome::refused && p->freedom == Freedom::anywhere) {
    outcome = search(h, p->position);
  }
  if (outcome == Outcome::refused) {
    refused_[static_cast<std::size_t>(e.idx())] = true;
    ++refused_count_;
  }
}

/// Other positions for a collapse whose best one fails a bound: the ends, the middle, then points strewn around the
/// best one. The sequence depends on the edge alone, so that results repeat.
CollapseLoop::Outcome CollapseLoop::search(Halfedge h, const glm::dvec3& best) {
  const Spot s0 = spot(from(h)), s1 = spot(to(h));
  for (const Spot& other : {s0, s1, store_((s0.position + s1.position) * 0.5)}) {
    const Outcome outcome = attempt(h, other);
    if (outcome != Outcome::refused) return outcome;
  }
  if (!(bounds_.within > 0)) return Outcome::refused;
  std::mt19937_64 random((static_cast<std::uint64_t>(from(h)) << 32) | to(h));
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  for (int i = 0; i < kTries; ++i) {
    const double spread = (i % 2 ? kWideSpread : kSpread) * bounds_.within;
    const double x = uniform(), y = uniform(), z = uniform();
    const Outcome outcome = attempt(h, store_(best + spread * glm::dvec3(x, y, z)));
    if (outcome != Outcome::refused) return outcome;
  }
  return Outcome::refused;
}

CollapseLoop::Outcome CollapseLoop::attempt(Halfedge h, const Spot& spot) {
  const glm::dvec3& position = spot.position;
  if (!std::isfinite(glm::dot(position, glm::dvec3(1))))
    return Outcome::refused;  // beyond the range of the stored type
  if (!mesh_.is_collapse_ok(h) || !gather(h, position)) return Outcome::impossible;
  if (!wedges_.empty() && !wedges_fit(h)) return Outcome::impossible;
  if (!copies_.empty() && !slots_fit(h)) return Outcome::impossible;
  if (folds_over() || !within_bounds(position) || !boundary_within_bounds(h, position)) return Outcome::refused;
  apply(h, spot);
  return Outcome::done;
}

void CollapseLoop::gather_side(Halfedge h, std::uint32_t vertex, const glm::dvec3& position, double moved) {
  const int skip0 = mesh_.face_handle(h).idx(), skip1 = mesh_.opposite_face_handle(h).idx();
  // Around `vertex` by its outgoing halfedges.
  const Halfedge start = mesh_.halfedge_handle(OpenMesh::VertexHandle(static_cast<int>(vertex)));
  Halfedge at = start;
  do {
    const int f = mesh_.face_handle(at).idx();
    if (f >= 0 && f != skip0 && f != skip1) {
      const glm::uvec3& t = triangles_[static_cast<std::size_t>(f)];
      const int corner = t.x == vertex ? 0 : t.y == vertex ? 1 : 2;
      Coverage::Element element{
          static_cast<std::uint32_t>(f), {positions_[t.x], positions_[t.y], positions_[t.z]}, moved};
      element.corners[corner] = position;
      elements_.push_back(element);
      ring_.push_back({corner, positions_[vertex], {t.x, t.y, t.z}, 0});
    }
    at = mesh_.next_halfedge_handle(mesh_.opposite_halfedge_handle(at));
  } while (at != start);
}

bool CollapseLoop::gather(Halfedge h, const glm::dvec3& position) {
  elements_.clear();
  ring_.clear();
  removed_.clear();
  const std::uint32_t v0 = from(h), v1 = to(h);
  const double moved0 = glm::length(positions_[v0] - position), moved1 = glm::length(positions_[v1] - position);
  gather_side(h, v0, position, moved0);
  const std::size_t of_v0 = elements_.size();
  // Faces around the kept vertex do not change when it stays where it is.
  if (moved1 > 0) gather_side(h, v1, position, moved1);

  const Halfedge o = mesh_.opposite_halfedge_handle(h);
  std::uint32_t apex[2] = {Coverage::kNone, Coverage::kNone};
  for (int side = 0; side < 2; ++side) {
    const Halfedge edge = side == 0 ? h : o;
    const int f = mesh_.face_handle(edge).idx();
    if (f < 0) continue;
    apex[side] = to(mesh_.next_halfedge_handle(edge));
    // The two other edges of the removed face: the one at v0 first, because the faces around v0 always are in the ring.
    Halfedge at_v0 = mesh_.next_halfedge_handle(edge), at_v1 = mesh_.prev_halfedge_handle(edge);
    if (side == 0) std::swap(at_v0, at_v1);
    int heir = mesh_.opposite_face_handle(at_v0).idx();
    if (heir < 0) heir = mesh_.opposite_face_handle(at_v1).idx();
    if (heir < 0) return false;
    std::size_t place = 0;
    while (place < elements_.size() && elements_[place].id != static_cast<std::uint32_t>(heir)) ++place;
    if (place == elements_.size()) {
      const glm::uvec3& t = triangles_[static_cast<std::size_t>(heir)];
      elements_.push_back({static_cast<std::uint32_t>(heir), {positions_[t.x], positions_[t.y], positions_[t.z]}, 0});
      ring_.push_back({0, positions_[t.x], {t.x, t.y, t.z}, 0});
    }
    removed_.push_back({static_cast<std::uint32_t>(f), static_cast<std::uint32_t>(place), std::max(moved0, moved1)});
  }
  // The last closed shape, a tetrahedron, is kept: two coinciding faces would be left of it.
  if (of_v0 == 1 && apex[0] != Coverage::kNone && apex[1] != Coverage::kNone) {
    const Halfedge across = mesh_.find_halfedge(OpenMesh::VertexHandle(static_cast<int>(apex[0])),
                                                OpenMesh::VertexHandle(static_cast<int>(apex[1])));
    for (const Halfedge side : {across, mesh_.opposite_halfedge_handle(across)}) {
      if (!mesh_.is_boundary(side) && to(mesh_.next_halfedge_handle(side)) == v1) return false;
    }
  }
  return true;
}

bool CollapseLoop::wedges_fit(Halfedge h) {
  new_wedges_.clear();
  const std::uint32_t v0 = from(h), v1 = to(h);
  const auto corner_of = [&](std::uint32_t f, std::uint32_t v) {
    return triangles_[f].x == v ? 0 : triangles_[f].y == v ? 1 : 2;
  };
  struct Side {
    std::uint32_t lost;  ///< the wedge at v0
    Corner gained;       ///< what takes its place at v1
  };
  std::array<Side, 2> sides{};
  std::size_t count = 0;
  for (const Halfedge side : {h, mesh_.opposite_halfedge_handle(h)}) {
    const int face = mesh_.face_handle(side).idx();
    if (face < 0) continue;
    const std::uint32_t f = static_cast<std::uint32_t>(face);
    const int c0 = corner_of(f, v0), c1 = corner_of(f, v1);
    sides[count++] = {wedges_[f][c0], {wedges_[f][c1], corner_source_[f][c1]}};
  }
  // One wedge at v0 would have to become two at v1.
  if (count == 2 && sides[0].lost == sides[1].lost && sides[0].gained.wedge != sides[1].gained.wedge) return false;
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const RingFace& face = ring_[i];
    if (face.vertices[face.corner] != v0) continue;
    const std::uint32_t f = elements_[i].id, wedge = wedges_[f][face.corner];
    const auto side = std::find_if(sides.begin(), sides.begin() + static_cast<std::ptrdiff_t>(count),
                                   [&](const Side& s) { return s.lost == wedge; });
    if (side == sides.begin() + static_cast<std::ptrdiff_t>(count)) return false;
    new_wedges_.push_back({f, face.corner, side->gained});
  }
  return true;
}

/// Whether an edge joins the two in the result, be it between copies of them.
bool CollapseLoop::joined_by_other(std::uint32_t a, std::uint32_t b) const {
  const auto with_copies = [&](const std::uint32_t& v) {
    const auto found = copies_.find(slots_[v]);
    return found == copies_.end() ? std::span(&v, 1) : std::span<const std::uint32_t>(found->second);
  };
  for (const std::uint32_t x : with_copies(a)) {
    for (const std::uint32_t y : with_copies(b)) {
      if ((x != a || y != b) &&
          mesh_.find_halfedge(OpenMesh::VertexHandle(static_cast<int>(x)), OpenMesh::VertexHandle(static_cast<int>(y)))
              .is_valid()) {
        return true;
      }
    }
  }
  return false;
}

/// The link condition across cuts: the kernel holds copies of a cut vertex for different vertices, the result does not.
/// No new edge may run beside one that there is between copies, nor a whole face (its three edges then all do).
bool CollapseLoop::slots_fit(Halfedge h) const {
  const std::uint32_t v0 = from(h), v1 = to(h);
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const RingFace& face = ring_[i];
    if (face.vertices[face.corner] != v0) continue;
    const std::uint32_t a = face.vertices[(face.corner + 1) % 3], b = face.vertices[(face.corner + 2) % 3];
    if (joined_by_other(v1, a) || joined_by_other(v1, b)) return false;
  }
  return true;
}

bool CollapseLoop::folds_over() const {
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const auto& c = elements_[i].corners;
    const RingFace& face = ring_[i];
    // With the moving corner as apex, both normals share the opposite edge.
    const glm::dvec3 &a = c[(face.corner + 1) % 3], &b = c[(face.corner + 2) % 3];
    const glm::dvec3 before = glm::cross(b - a, face.before - a), after = glm::cross(b - a, c[face.corner] - a);
    const double before2 = squared_length(before), after2 = squared_length(after), cosine = glm::dot(before, after);
    if (!(before2 > 0)) continue;  // a degenerate face has no side to keep
    if (!(cosine > 0 && cosine * cosine >= kFoldCosine * kFoldCosine * before2 * after2)) return true;
  }
  return false;
}

bool CollapseLoop::within_bounds(const glm::dvec3& position) {
  if (bounds_.rival) return bounds_.rival->accepts(elements_, removed_);
  if (bounds_.forward) {
    const double within = bounds_.forward->within();
    new_distance_ = bounds_.forward->distance_bound(position);
    if (!(new_distance_ <= within)) return false;
    for (std::size_t k = 0; k < elements_.size(); ++k) {
      const std::size_t i = (suspect_ + k) % elements_.size();
      const Coverage::Element& element = elements_[i];
      RingFace& face = ring_[i];
      // No point of the face moves farther than its moving corner.
      face.distance = face_distance_[element.id] + element.moved;
      if (element.moved == 0 || face.distance <= within) continue;
      glm::dvec3 bounds(distance_[face.vertices[0]], distance_[face.vertices[1]], distance_[face.vertices[2]]);
      bounds[face.corner] = new_distance_;
      face.distance = bounds_.forward->bound(element.corners, bounds);
      if (face.distance == TriangleCertificate::kUnproved) {
        suspect_ = i;
        return false;
      }
    }
  }
  return !bounds_.backward || bounds_.backward->try_change(elements_, removed_);
}

bool CollapseLoop::boundary_within_bounds(Halfedge h, const glm::dvec3& position) {
  boundary_elements_.clear();
  if (!bounds_.boundary_backward) return true;
  Halfedge edge = h;
  if (!mesh_.is_boundary(edge)) edge = mesh_.opposite_halfedge_handle(h);
  if (!mesh_.is_boundary(edge)) return true;
  // The boundary runs a -> s -> t -> c; s and t merge into the end of h.
  const Halfedge previous = mesh_.prev_halfedge_handle(edge), next = mesh_.next_halfedge_handle(edge);
  const std::uint32_t a = from(previous), s = from(edge), t = to(edge), c = to(next), kept = to(h);
  const double moved_s = glm::length(positions_[s] - position), moved_t = glm::length(positions_[t] - position);
  const glm::dvec3 &pa = positions_[a], &pc = positions_[c];
  boundary_elements_.push_back({a, {pa, position, position}, moved_s});
  boundary_removed_.clear();
  if (kept == t) {
    boundary_elements_.push_back({t, {position, pc, pc}, moved_t});
    boundary_removed_.push_back({s, 1, std::max(moved_s, moved_t)});
  } else {
    boundary_elements_.push_back({s, {position, pc, pc}, std::max(moved_s, moved_t)});
    boundary_removed_.push_back({t, 1, moved_t});
  }
  const glm::dvec3 unknown(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < 2; ++i) {
    if (boundary_elements_[i].moved == 0) continue;
    if (bounds_.boundary_forward->bound(boundary_elements_[i].corners, unknown) == TriangleCertificate::kUnproved)
      return false;
  }
  return bounds_.boundary_backward->try_change(boundary_elements_, boundary_removed_);
}

void CollapseLoop::apply(Halfedge h, const Spot& spot) {
  const std::uint32_t v0 = from(h), v1 = to(h);
  if (bounds_.rival) bounds_.rival->commit();
  if (bounds_.backward) bounds_.backward->commit();
  if (!boundary_elements_.empty()) bounds_.boundary_backward->commit();
  for (const NewWedge& n : new_wedges_) {
    wedges_[n.triangle][n.corner] = n.gained.wedge;
    corner_source_[n.triangle][n.corner] = n.gained.source;
  }
  for (const RingFace& face : ring_) {
    const std::size_t i = static_cast<std::size_t>(&face - ring_.data());
    if (face.vertices[face.corner] == v0) triangles_[elements_[i].id][face.corner] = v1;
    if (bounds_.forward) face_distance_[elements_[i].id] = face.distance;
  }
  triangle_count_ -= removed_.size();
  mesh_.collapse(h);
  moved_[v1] = moved_[v1] || spot.position != positions_[v1];
  positions_[v1] = spot.position;
  stored_[v1] = spot.stored;
  quadrics_[v1] += quadrics_[v0];
  if (bounds_.forward) distance_[v1] = new_distance_;
  merged_into_[v0] = v1;
  renew(v1);
}

void CollapseLoop::renew(std::uint32_t vertex) {
  const OpenMesh::VertexHandle v(static_cast<int>(vertex));
  for (const auto e : mesh_.ve_range(v)) push(e);
  if (refused_count_ == 0) return;
  for (const auto near : mesh_.vv_range(v)) {
    for (const auto e : mesh_.ve_range(near)) {
      const std::size_t i = static_cast<std::size_t>(e.idx());
      if (refused_[i]) push(e);
    }
  }
}

}  // namespace tolvol
