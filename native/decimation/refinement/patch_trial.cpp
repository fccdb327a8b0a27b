// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/patch_trial.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <stdexcept>

#include "base/call.h"
#include "decimation/refinement/separation.h"

namespace tolvol {
namespace {

constexpr double kAnywhere = std::numeric_limits<double>::infinity();

/// The number of steps that fit the vertex of a collapse alone.
constexpr int kStepsOfPrice = 8;
/// The numbers of steps by the lower power, by the higher power, and after each refusal of the certificates.
constexpr int kStepsOfSum = 14, kStepsOfLargest = 16, kStepsAfterRefusal = 10;
/// From a larger deviation than this, in tolerances, the higher power hardly ever leads to success from the first
/// start, and from further ones.
constexpr double kWorthGoingOn = 1.25, kWorthGoingOnAgain = 1.1;
/// The certificates are asked at most this often.
constexpr int kMostRefusals = 12;
/// After a refusal at most kLookedAt parts without a witness are looked at for each face. Points of at most kHeld of
/// them are held from then on. Each point that is held has the weight kHeldWeight.
constexpr std::size_t kLookedAt = 24, kHeld = 4;
constexpr double kHeldWeight = 0.05;
/// A try that came to at most so many tolerances is a near miss. At most kMostFlippedFirst edges are flipped first.
constexpr double kNearMiss = 1.2;
constexpr int kMostFlippedFirst = 20;
/// A face that has no proof is looked at in the points of a grid that divides each edge into this many parts.
constexpr int kPartsOfEdge = 24;

}  // namespace

PatchTrial::PatchTrial(const BoundedMesh& mesh, const SurfaceSamples& samples, Surroundings* around)
    : mesh_(mesh), bounds_(*mesh.certified()), samples_(samples), around_(around), change_(mesh), deviations_(bounds_) {
  backward_.look_for_failures(kLookedAt);
}

/// Prepares a collapse and a patch around it, with its samples.
bool PatchTrial::prepare(Halfedge h, const glm::dvec3& position, int rings) {
  // A vertex that stays where it is keeps its bits, which mapping from the frame need not give.
  const std::uint32_t end = mesh_.to(h);
  const VertexPosition target = position == mesh_.position(end) ? mesh_.vertex_position(end) : mesh_.store(position);
  if (!mesh_.may_hold(target) || !change_.prepare_collapse(h, target) || change_.folds_over()) return false;
  if (!patch_.gather(change_, rings, !bounds_.bounds_boundaries())) return false;
  deviations_.start(patch_);
  for (std::uint32_t f = 0; f < patch_.faces().size(); ++f) deviations_.add(samples_.of(patch_.faces()[f].id), f);
  for (const Coverage::Removed& r : change_.removed()) deviations_.add(samples_.of(r.id), r.successor);
  deviations_.renew();
  return true;
}

std::optional<PatchTrial::Price> PatchTrial::price(BoundedMesh::Edge edge) {
  std::optional<Price> best;
  const auto [freedom, h] = mesh_.merge(edge);
  if (freedom == BoundedMesh::Freedom::none) return best;
  const auto offer = [&](Halfedge halfedge, const glm::dvec3& position) {
    if (!prepare(halfedge, position, 1)) return;
    // Neighbours that are free here would be at the rim of a patch.
    double before = 0;
    const auto add = [&](std::uint32_t face) { before += samples_.energy(face); };
    for (const Patch::Face& f : patch_.faces()) add(f.id);
    for (const Coverage::Removed& r : change_.removed()) add(r.id);
    relaxation_.lower_sum(deviations_, kStepsOfPrice, false);
    const std::uint32_t kept = patch_.find_vertex(*change_.vertex());
    const PatchDeviations::State now = deviations_.state();
    if (best && now.energy - before >= best->rise) return;
    best = {now.energy - before, now.largest, halfedge, patch_.vertices()[kept].position};
  };
  const glm::dvec3 &from = mesh_.position(mesh_.from(h)), &to = mesh_.position(mesh_.to(h));
  if (freedom == BoundedMesh::Freedom::anywhere) {
    offer(h, 0.5 * (from + to));
    if (!best) offer(h, from);
  }
  if (!best) offer(h, to);
  if (freedom == BoundedMesh::Freedom::either_way) offer(mesh_.connectivity().opposite_halfedge_handle(h), from);
  return best;
}

bool PatchTrial::try_collapse(const Price& price, const Effort& effort) {
  crossings_.crossings.begin();
  met_another_ = false;
  vanished_ = mesh_.from(price.halfedge);
  reached_ = kAnywhere;
  work_ = 0;
  for (int start = 0; prepare(price.halfedge, price.position, effort.rings); ++start) {
    const std::uint32_t kept = patch_.find_vertex(*change_.vertex());
    if (start > 0 && !EdgeFlips::flip_near(deviations_, kept, start - 1)) {
      work_ += deviations_.work();
      return false;
    }
    const bool again = start > 0;
    const bool possible = relax_and_certify(again ? kWorthGoingOnAgain : kWorthGoingOn, effort.quick || again);
    work_ += deviations_.work();
    if (possible) return true;
    if (start == 0) reached_ = deviations_.state().largest;
    if (!effort.many_starts || reached_ > kNearMiss || start == kMostFlippedFirst) return false;
  }
  return false;
}

bool PatchTrial::relax_and_certify(double worth_going_on, bool quick) {
  if (!relax(worth_going_on)) return false;
  for (int refusals = 0; refusals < kMostRefusals; ++refusals) {
    learnt_ = false;
    if (certify()) return true;
    if (!learnt_) return false;
    deviations_.renew();
    // Where the samples see nothing to lower, nothing would move, and the certificates would refuse the same again.
    if (deviations_.enough() || deviations_.is_stuck()) return false;
    quick ? relaxation_.try_lower_largest(deviations_, kStepsAfterRefusal)
          : relaxation_.lower_largest(deviations_, kStepsAfterRefusal);
    if (!deviations_.enough()) return false;
  }
  return false;
}

bool PatchTrial::relax(double worth_going_on) {
  if (!relaxation_.lower_sum(deviations_, kStepsOfSum, true)) return false;
  if (!deviations_.enough() && deviations_.state().largest <= worth_going_on) {
    relaxation_.lower_largest(deviations_, kStepsOfLargest);
  }
  return deviations_.enough();
}

bool PatchTrial::certify() {
  round_positions();
  if (leaves_cell() || meets_another()) return false;
  gather_elements();
  // A sheet that was in the way once likely still is, and the other questions take longer.
  const bool asked = deviations_.has_separations();
  if (asked && !uncrossed()) return false;
  return pieces_hold() && faces_hold() && boundary_holds() && (asked || uncrossed());
}

/// Puts the vertices where the stored type can hold them.
void PatchTrial::round_positions() {
  positions_.clear(), moved_.clear();
  for (Patch::Vertex& v : patch_.vertices()) {
    VertexPosition position = mesh_.vertex_position(v.id);
    if (v.free) {
      position = mesh_.store(v.position);
    } else if (v.position != position.position) {
      position = change_.position();  // It is kept, a copy of that, or carried there; none of these is free then.
    }
    moved_.push_back(position.position != mesh_.position(v.id));
    v.position = position.position;
    positions_.push_back(position);
  }
}

bool PatchTrial::leaves_cell() const {
  for (std::uint32_t v = 0; v < positions_.size(); ++v) {
    if (moved_[v] && !mesh_.may_hold(positions_[v])) return true;
  }
  return false;
}

bool PatchTrial::meets_another() {
  for (std::uint32_t v = 0; v < positions_.size(); ++v) {
    const std::uint32_t id = patch_.vertices()[v].id;
    const bool is_free = patch_.vertices()[v].free;
    const bool is_kept = id == *change_.vertex();
    if ((is_free || is_kept) && mesh_.meets_another(positions_[v], id, is_kept ? vanished_ : id)) met_another_ = true;
    for (std::uint32_t w = 0; w < v; ++w) {
      // Copies, none of which is free, are at one place.
      if ((is_free || patch_.vertices()[w].free) && positions_[v].stored == positions_[w].stored) return true;
    }
  }
  return met_another_;
}

bool PatchTrial::changed(std::uint32_t face) const {
  const Patch::Face& f = patch_.faces()[face];
  return f.changed || moved_[f.corners[0]] || moved_[f.corners[1]] || moved_[f.corners[2]];
}

void PatchTrial::gather_elements() {
  elements_.clear(), removed_.clear();
  for (std::uint32_t f = 0; f < patch_.faces().size(); ++f) {
    elements_.push_back({patch_.faces()[f].id,
                         {patch_.position(f, 0), patch_.position(f, 1), patch_.position(f, 2)},
                         changed(f) ? kAnywhere : 0});
  }
  for (const Coverage::Removed& r : change_.removed()) removed_.push_back({r.id, r.successor, kAnywhere});
}

/// Whether every piece of the reference that a face of the patch was the witness of has a witness in the patch.
bool PatchTrial::pieces_hold() {
  const Coverage* const backward = bounds_.backward();
  if (!backward || backward->try_change(elements_, removed_, backward_)) return true;
  struct Named {
    std::uint32_t element;
    double deviation;
    glm::dvec3 point;
  };
  std::vector<Named> named;
  for (const Coverage::Failure& failure : backward_.failed()) {
    const auto& [a, b, c] = failure.part.corners;
    Named worst{failure.element, -1, {}};
    for (const glm::dvec3& p : {(a + b + c) * (1.0 / 3), a, b, c}) {
      std::uint32_t face = failure.element;
      const double deviation = deviations_.deviation(p, face);
      if (deviation > worst.deviation) worst.deviation = deviation, worst.point = p;
    }
    named.push_back(worst);
  }
  std::ranges::sort(named, [](const Named& x, const Named& y) {
    return x.element != y.element ? x.element < y.element : x.deviation > y.deviation;
  });
  for (std::size_t i = 0; i < named.size(); ++i) {
    if (i >= kHeld && named[i - kHeld].element == named[i].element) continue;
    deviations_.add_reference_point(named[i].point, kHeldWeight, named[i].element);
  }
  learnt_ = true;
  return false;
}

bool PatchTrial::faces_hold() {
  vertex_bounds_.clear(), face_bounds_.clear();
  const TriangleCertificate& forward = bounds_.forward();
  for (std::uint32_t v = 0; v < positions_.size(); ++v) {
    const std::uint32_t id = patch_.vertices()[v].id;
    vertex_bounds_.push_back(moved_[v] ? forward.nearest(positions_[v].position, forward.limit())
                                       : bounds_.vertex_bound(id));
    const bool asked = moved_[v] || id == *change_.vertex();  // The vertex that is kept may have a smaller share now.
    if (asked && !(vertex_bounds_[v].distance <= patch_.vertices()[v].share * forward.limit())) return false;
  }
  bool hold = true;
  for (std::uint32_t f = 0; f < elements_.size(); ++f) {
    glm::dvec3 open(kAnywhere);
    face_bounds_.push_back(changed(f) ? prove(f, open) : bounds_.face_bound(elements_[f].id));
    if (!changed(f) || face_bounds_[f].distance != TriangleCertificate::kUnproved) continue;
    hold = false;
    if (!add_face_points(f)) add_open_point(f, open);
  }
  return hold;
}

/// What can be proved of a face that has changed. If nothing can, sets `open` to a point of it, or leaves it where the
/// face has no sure normal.
FaceBound PatchTrial::prove(std::uint32_t face, glm::dvec3& open) const {
  const auto& c = patch_.faces()[face].corners;
  const auto share = [&](int k) { return patch_.vertices()[c[k]].share; };
  const CertifiedBounds::PointBound known[3] = {vertex_bounds_[c[0]], vertex_bounds_[c[1]], vertex_bounds_[c[2]]};
  return bounds_.prove(elements_[face].id, elements_[face].corners, known, std::min({share(0), share(1), share(2)}),
                       CertifiedBounds::Search::in_any_order, &open);
}

/// Adds the points of a face that are farthest from the reference, near each of its corners one, if they are beyond
/// what is enough. Returns whether there are any.
bool PatchTrial::add_face_points(std::uint32_t face) {
  glm::dvec3 worst[3];
  double largest[3] = {PatchDeviations::kEnough, PatchDeviations::kEnough, PatchDeviations::kEnough};
  for (int i = 0; i <= kPartsOfEdge; ++i) {
    for (int j = 0; i + j <= kPartsOfEdge; ++j) {
      const glm::dvec3 weights = glm::dvec3(i, j, kPartsOfEdge - i - j) / static_cast<double>(kPartsOfEdge);
      const double deviation = deviations_.deviation_of(face, weights);
      const int corner = weights.x >= weights.y ? (weights.x >= weights.z ? 0 : 2) : (weights.y >= weights.z ? 1 : 2);
      if (deviation > largest[corner]) largest[corner] = deviation, worst[corner] = weights;
    }
  }
  bool any = false;
  for (int k = 0; k < 3; ++k) {
    if (!(largest[k] > PatchDeviations::kEnough)) continue;
    deviations_.add_face_point(face, worst[k], kHeldWeight);
    any = learnt_ = true;
  }
  return any;
}

/// Adds the point that the search for a proof of a face left open, if it is beyond what is enough from all that the
/// face may stand for: the face may be near the reference and turned from it, or too far between the points looked at.
void PatchTrial::add_open_point(std::uint32_t face, const glm::dvec3& open) {
  const auto& [a, b, c] = elements_[face].corners;
  const glm::dvec3 normal = glm::cross(b - a, c - a);
  const double square = glm::dot(normal, normal);
  if (!(square > 0) || open.x == kAnywhere) return;
  const double of_b = glm::dot(glm::cross(open - a, c - a), normal) / square;
  const double of_c = glm::dot(glm::cross(b - a, open - a), normal) / square;
  const glm::dvec3 weights(1 - of_b - of_c, of_b, of_c);
  if (!(deviations_.admitted_deviation_of(face, weights) > PatchDeviations::kEnough)) return;
  deviations_.add_open_point(face, weights, kHeldWeight);
  learnt_ = true;
}

/// Whether the boundary edges of the patch keep the bounds of boundaries, if there are any. Edges that were cut are
/// none: they cover nothing.
bool PatchTrial::boundary_holds() {
  boundary_elements_.clear(), boundary_removed_.clear();
  if (!bounds_.bounds_boundaries()) return true;
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  const Halfedge h = change_.halfedge();
  // The boundary runs s -> t, and one vanishes into the other. The pieces of the edge that goes become those of the
  // boundary edge that ends in t, if s vanishes, or else of the one that begins in s.
  const bool start_vanishes = connectivity.is_boundary(h);
  const bool is_along = start_vanishes || connectivity.is_boundary(connectivity.opposite_halfedge_handle(h));
  if (!is_along && mesh_.on_boundary(vanished_)) return false;
  std::optional<std::uint32_t> successor;
  for (std::uint32_t f = 0; f < patch_.faces().size(); ++f) {
    const Patch::Face& face = patch_.faces()[f];
    for (int k = 0; k < 3; ++k) {
      if (!face.boundary[k]) continue;
      // The boundary runs against the face, and its edges have the names of their first vertices.
      const std::uint32_t from = face.corners[(k + 1) % 3], to = face.corners[k];
      const std::uint32_t name = patch_.vertices()[from].id, end = patch_.vertices()[to].id;
      if (mesh_.is_cut(name, end)) continue;
      const glm::dvec3 &a = positions_[from].position, &b = positions_[to].position;
      if ((start_vanishes ? end : name) == *change_.vertex()) {
        successor = static_cast<std::uint32_t>(boundary_elements_.size());
      }
      const Halfedge before = connectivity.find_halfedge(BoundedMesh::handle(name), BoundedMesh::handle(end));
      const bool was_there = before.is_valid() && connectivity.is_boundary(before);
      boundary_elements_.push_back({name, {a, b, b}, moved_[from] || moved_[to] || !was_there ? kAnywhere : 0});
    }
  }
  if (is_along) {
    if (!successor) return false;
    boundary_removed_.push_back({vanished_, *successor, kAnywhere});
  }
  if (boundary_elements_.empty()) return true;
  const glm::dvec3 unknown(kAnywhere);
  for (const Coverage::Element& e : boundary_elements_) {
    if (e.moved > 0 && bounds_.boundary_forward()->bound(e.corners, unknown) == TriangleCertificate::kUnproved) {
      return false;
    }
  }
  return bounds_.boundary_backward()->try_change(boundary_elements_, boundary_removed_, boundary_backward_);
}

bool PatchTrial::uncrossed() {
  if (!around_) return true;
  crossings_.faces.clear();
  for (std::uint32_t f = 0; f < elements_.size(); ++f) {
    const auto& c = patch_.faces()[f].corners;
    const Corners corners{positions_[c[0]].stored, positions_[c[1]].stored, positions_[c[2]].stored};
    if (corners != around_->corners(elements_[f].id)) crossings_.faces.push_back({elements_[f].id, corners});
  }
  gather_removed(change_, crossings_.removed);
  if (around_->allow(crossings_)) return true;
  learnt_ = keep_sheets_apart();
  return false;
}

/// Adds what holds the changed faces on their sides of the faces near by, in place of what was added before. Returns
/// whether they are not there yet.
bool PatchTrial::keep_sheets_apart() {
  const auto corners = [&](std::uint32_t face) {
    const glm::uvec3& t = mesh_.triangle(face);
    return Corners{mesh_.position(t.x), mesh_.position(t.y), mesh_.position(t.z)};
  };
  Sheet sheet;
  for (const Coverage::Element& e : elements_) sheet.add(corners(e.id));
  for (const Coverage::Removed& r : removed_) sheet.add(corners(r.id));
  const double reach = bounds_.forward().limit();
  std::vector<Separation> separations;
  deviations_.drop_separations();
  for (const std::uint32_t id : around_->faces_near(crossings_)) {
    poll();
    if (id >= mesh_.connectivity().n_faces()) continue;  // It never changes, and the frame does not have it.
    const Corners other = corners(id);
    Box near = box_of(other);
    near.lower -= reach, near.upper += reach;
    for (std::uint32_t f = 0; f < elements_.size(); ++f) {
      const auto& [a, b, c] = elements_[f].corners;
      const Corners face{a, b, c};
      if (!changed(f) || !meet(box_of(face), near)) continue;
      separations.clear();
      separate(face, other, sheet, reach, separations);
      for (const Separation& s : separations) deviations_.add_separation(f, s, kHeldWeight);
    }
  }
  deviations_.renew();
  return !deviations_.enough();
}

Box PatchTrial::carry_out(BoundedMesh& mesh) {
  assert(&mesh == &mesh_);
  if (Coverage* const backward = bounds_.backward()) backward->commit(backward_);
  if (!boundary_elements_.empty()) bounds_.boundary_backward()->commit(boundary_backward_);
  for (std::uint32_t v = 0; v < positions_.size(); ++v) {
    if (moved_[v]) bounds_.note(patch_.vertices()[v].id, vertex_bounds_[v]);
  }
  for (std::uint32_t f = 0; f < elements_.size(); ++f) {
    bounds_.note_face(elements_[f].id, face_bounds_[f]);
  }
  const Box changed = around_ ? around_->follow(crossings_) : Box();

  const std::uint32_t kept = patch_.find_vertex(*change_.vertex());
  const auto apply = [&](bool is_possible) {
    if (!is_possible) throw std::logic_error("the mesh does not allow what its patch allowed");
    mesh.apply(change_);
  };
  apply(change_.prepare_collapse(change_.halfedge(), positions_[kept]));
  const OpenMesh::TriConnectivity& connectivity = mesh.connectivity();
  for (const Patch::Flip& flip : patch_.flips()) {
    const Halfedge h = connectivity.find_halfedge(BoundedMesh::handle(flip.from), BoundedMesh::handle(flip.to));
    apply(h.is_valid() && change_.prepare_flip(connectivity.edge_handle(h)));
  }
  for (std::uint32_t v = 0; v < positions_.size(); ++v) {
    const std::uint32_t id = patch_.vertices()[v].id;
    if (!patch_.vertices()[v].free || v == kept || positions_[v].stored == mesh.stored(id)) continue;
    apply(change_.prepare_relocate(id, positions_[v]));
  }
  return changed;
}

}  // namespace tolvol
