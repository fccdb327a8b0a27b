// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/change_trial.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace tolvol {
namespace {

/// Whether the stored type can hold the position.
bool is_finite(const VertexPosition& target) { return std::isfinite(glm::dot(target.position, glm::dvec3(1))); }

}  // namespace

void ChangeTrial::begin() {
  prepared_ = met_another_ = false, failed_last_ = 0;
  backward_.begin(), boundary_backward_.begin();
}

bool ChangeTrial::prepare_collapse(Halfedge h, const VertexPosition& target) {
  prepared_ = true;
  return change_.prepare_collapse(h, target);
}

bool ChangeTrial::prepare_relocate(std::uint32_t vertex, const VertexPosition& target) {
  prepared_ = true;
  return change_.prepare_relocate(vertex, target);
}

bool ChangeTrial::prepare_flip(Edge e) {
  prepared_ = true;
  return change_.prepare_flip(e);
}

ChangeTrial::Outcome ChangeTrial::try_collapse(Halfedge h, const VertexPosition& target) {
  if (!is_finite(target)) return Outcome::refused;
  return prepare_collapse(h, target) ? check() : Outcome::impossible;
}

ChangeTrial::Outcome ChangeTrial::try_relocate(std::uint32_t vertex, const VertexPosition& target) {
  if (!is_finite(target)) return Outcome::refused;
  return prepare_relocate(vertex, target) ? check() : Outcome::impossible;
}

ChangeTrial::Outcome ChangeTrial::try_flip(Edge e) { return prepare_flip(e) ? check() : Outcome::impossible; }

ChangeTrial::Outcome ChangeTrial::check() {
  if (change_.meets_another()) {
    met_another_ = true;
    return Outcome::refused;
  }
  const bool kept =
      !change_.folds_over() &&
      (proof_ == Proof::later ? vertex_is_inside(change_) : keeps_bounds(change_) && boundary_is_inside(change_));
  return kept ? Outcome::possible : Outcome::refused;
}

void ChangeTrial::carry_out(BoundedMesh& mesh) const {
  assert(&mesh == &change_.mesh());
  const Bounds& bounds = mesh.bounds();
  const bool proved = proof_ == Proof::now;
  if (bounds.baseline) bounds.baseline->commit();
  if (bounds.backward && proved) bounds.backward->commit(backward_);
  if (!boundary_elements_.empty()) bounds.boundary_backward->commit(boundary_backward_);
  if (bounds.forward) {
    for (std::size_t i = 0; i < face_distances_.size() && proved; ++i) {
      mesh.note_face_distance(change_.elements()[i].id, face_distances_[i]);
    }
    for (const std::uint32_t v : change_.carried()) mesh.note_distance(v, vertex_distance_);
    if (const auto v = change_.vertex()) mesh.note_distance(*v, vertex_distance_);
  }
  mesh.apply(change_);
}

/// In the order of what the answers cost.
bool ChangeTrial::keeps_bounds(const Change& change) {
  const Bounds& bounds = change.mesh().bounds();
  if (bounds.baseline) return bounds.baseline->accepts(change.elements(), change.removed());
  if (bounds.forward && ((change.vertex() && !vertex_is_inside(change)) || shows_outside(change))) return false;
  if (bounds.backward && !bounds.backward->try_change(change.elements(), change.removed(), backward_)) return false;
  return !bounds.forward || faces_are_inside(change);
}

bool ChangeTrial::vertex_is_inside(const Change& change) {
  const TriangleCertificate& forward = *change.mesh().bounds().forward;
  vertex_distance_ = forward.distance_bound(change.position().position);
  return vertex_distance_ <= change.share() * forward.limit();
}

/// Whether a face is likely to lie near many triangles of the reference.
bool ChangeTrial::is_large(const Change& change, const Coverage::Element& e) const {
  constexpr double kLarge = 8;  // times the tolerance
  const double large = kLarge * change.mesh().bounds().forward->limit();
  return longest_squared({{e.corners[0], e.corners[1], e.corners[2]}}) > large * large;
}

/// Whether a point of a large face is outside: before anything is proved in vain.
bool ChangeTrial::shows_outside(const Change& change) {
  const TriangleCertificate& forward = *change.mesh().bounds().forward;
  const std::size_t count = change.elements().size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = (failed_last_ + k) % count;
    const Coverage::Element& element = change.elements()[i];
    if (element.moved == 0 || !is_large(change, element)) continue;
    if (forward.narrowed(change.share(change.faces()[i])).shows_outside(element.corners)) {
      failed_last_ = i;
      return true;
    }
  }
  return false;
}

bool ChangeTrial::faces_are_inside(const Change& change) {
  const BoundedMesh& mesh = change.mesh();
  const std::size_t count = change.elements().size();
  replaced_faces_.clear();
  face_distances_.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = (failed_last_ + k) % count;
    const Coverage::Element& element = change.elements()[i];
    const Change::Face& face = change.faces()[i];
    double& distance = face_distances_[i];
    const TriangleCertificate forward = mesh.bounds().forward->narrowed(change.share(face));
    // No point of the face moves farther than its moving corner.
    distance = mesh.face_distance(element.id) + element.moved;
    if (element.moved == 0 || distance <= forward.limit()) continue;
    if (is_large(change, element)) {
      if (replaced_faces_.empty()) gather_replaced_faces(change);
      distance = replaced_faces_.bound(element.corners, forward.limit());
      if (distance <= forward.limit()) continue;
    }
    glm::dvec3 corners(mesh.distance(face.vertices[0]), mesh.distance(face.vertices[1]),
                       mesh.distance(face.vertices[2]));
    if (change.vertex()) corners[face.corner] = vertex_distance_;
    distance = forward.bound_with_room(element.corners, corners);
    if (distance == TriangleCertificate::kUnproved) {
      failed_last_ = i;
      return false;
    }
  }
  return true;
}

void ChangeTrial::gather_replaced_faces(const Change& change) {
  const BoundedMesh& mesh = change.mesh();
  const auto add = [&](std::uint32_t id) {
    const glm::uvec3& t = mesh.triangle(id);
    replaced_faces_.add(mesh.position(t.x), mesh.position(t.y), mesh.position(t.z), mesh.face_distance(id));
  };
  for (const Coverage::Element& e : change.elements()) add(e.id);
  for (const Coverage::Removed& r : change.removed()) add(r.id);
}

/// Boundary edges as a collapse or a relocation would leave them.
void ChangeTrial::gather_boundary(const Change& change) {
  boundary_elements_.clear(), boundary_removed_.clear();
  const BoundedMesh& mesh = change.mesh();
  if (!mesh.bounds().boundary_backward) return;
  if (change.kind() == Change::Kind::collapse) boundary_of_collapse(change);
  if (change.kind() == Change::Kind::relocate && mesh.on_boundary(*change.vertex())) boundary_of_relocation(change);
}

void ChangeTrial::boundary_of_collapse(const Change& change) {
  const BoundedMesh& mesh = change.mesh();
  const OpenMesh::TriConnectivity& connectivity = mesh.connectivity();
  BoundedMesh::Halfedge edge = change.halfedge();
  if (!connectivity.is_boundary(edge)) edge = connectivity.opposite_halfedge_handle(edge);
  if (!connectivity.is_boundary(edge)) return;
  // The boundary runs a -> s -> t -> c; s and t merge into one.
  const auto previous = connectivity.prev_halfedge_handle(edge), next = connectivity.next_halfedge_handle(edge);
  const std::uint32_t a = mesh.from(previous), s = mesh.from(edge), t = mesh.to(edge), c = mesh.to(next);
  const glm::dvec3 &p = change.position().position, &pa = mesh.position(a), &pc = mesh.position(c);
  const double moved_s = glm::length(mesh.position(s) - p), moved_t = glm::length(mesh.position(t) - p);
  boundary_elements_.push_back({a, {pa, p, p}, moved_s});
  if (change.vertex() == t) {
    boundary_elements_.push_back({t, {p, pc, pc}, moved_t});
    boundary_removed_.push_back({s, 1, std::max(moved_s, moved_t)});
  } else {
    boundary_elements_.push_back({s, {p, pc, pc}, std::max(moved_s, moved_t)});
    boundary_removed_.push_back({t, 1, moved_t});
  }
}

void ChangeTrial::boundary_of_relocation(const Change& change) {
  const BoundedMesh& mesh = change.mesh();
  const OpenMesh::TriConnectivity& connectivity = mesh.connectivity();
  const std::uint32_t v = *change.vertex();
  // The kernel keeps the outgoing halfedge of a boundary vertex on the boundary.
  const auto next = connectivity.halfedge_handle(BoundedMesh::handle(v));
  const std::uint32_t a = mesh.from(connectivity.prev_halfedge_handle(next)), c = mesh.to(next);
  const glm::dvec3 &p = change.position().position, &pa = mesh.position(a), &pc = mesh.position(c);
  const double moved = glm::length(mesh.position(v) - p);
  boundary_elements_ = {{a, {pa, p, p}, moved}, {v, {p, pc, pc}, moved}};
}

bool ChangeTrial::boundary_is_inside(const Change& change) {
  gather_boundary(change);
  if (boundary_elements_.empty()) return true;
  const Bounds& bounds = change.mesh().bounds();
  const glm::dvec3 unknown(std::numeric_limits<double>::infinity());
  for (const Coverage::Element& e : boundary_elements_) {
    if (e.moved > 0 && bounds.boundary_forward->bound(e.corners, unknown) == TriangleCertificate::kUnproved)
      return false;
  }
  return bounds.boundary_backward->try_change(boundary_elements_, boundary_removed_, boundary_backward_);
}

}  // namespace tolvol
