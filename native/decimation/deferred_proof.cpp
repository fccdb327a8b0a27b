// SPDX-License-Identifier: GPL-3.0-or-later
// What the collapses of a region change is all within the faces around its vertices, but for the boundary: its
// halfedges beyond the region name those of the region that they follow or that follow them. No two regions change the
// same one of these names, so that regions can be worked on, proved and put back side by side.
#include "decimation/deferred_proof.h"

#include <algorithm>
#include <limits>

namespace tolvol {

DeferredProof::DeferredProof(EdgeCollapse& collapse, BoundedMesh& mesh, std::span<const std::uint32_t> vertices,
                             std::span<const std::uint32_t> faces, std::vector<std::uint32_t>& places)
    : collapse_(collapse),
      mesh_(mesh),
      vertices_(vertices),
      faces_(faces),
      places_(places),
      changed_(faces.size()),
      successors_(faces.size()) {
  for (std::uint32_t i = 0; i < faces.size(); ++i) places_[faces[i]] = successors_[i] = i;
  for (const std::uint32_t v : vertices) save_vertex(v);
  for (const std::uint32_t f : faces) save_face(f);
}

void DeferredProof::save_vertex(std::uint32_t v) {
  saved_vertices_.push_back(
      {mesh_.vertex_position(v), collapse_.quadric(v), mesh_.distance_[v], mesh_.share(v), mesh_.left_original(v)});
}

void DeferredProof::save_face(std::uint32_t f) {
  const Kernel& kernel = mesh_.mesh_;
  const bool wedges = !mesh_.wedges_.empty();
  saved_faces_.push_back({mesh_.triangles_[f], wedges ? mesh_.wedges_[f] : glm::uvec3(0), mesh_.corner_source_[f],
                          mesh_.face_distance_[f], kernel.face(BoundedMesh::face(f))});
  for (const auto h : kernel.fh_range(BoundedMesh::face(f))) {
    const BoundedMesh::Vertex from = kernel.from_vertex_handle(h);
    const BoundedMesh::Halfedge opposite = kernel.opposite_halfedge_handle(h);
    saved_halfedges_.push_back({h, kernel.halfedge(h)});
    saved_anchors_.push_back({static_cast<std::uint32_t>(from.idx()), kernel.halfedge_handle(from)});
    if (!kernel.is_boundary(opposite)) continue;
    saved_halfedges_.push_back({opposite, kernel.halfedge(opposite)});
    possible_ &= !mesh_.bounds().boundary_backward;
  }
}

void DeferredProof::note(const Change& change) {
  for (const Coverage::Element& e : change.elements()) {
    if (e.moved > 0) changed_[places_[e.id]] = true;
  }
  for (const Coverage::Removed& r : change.removed())
    successors_[places_[r.id]] = places_[change.elements()[r.successor].id];
}

bool DeferredProof::holds() {
  alive_.clear();
  rank_.assign(faces_.size(), 0);
  for (std::uint32_t i = 0; i < faces_.size(); ++i) {
    if (!mesh_.alive(faces_[i])) continue;
    rank_[i] = static_cast<std::uint32_t>(alive_.size());
    alive_.push_back(i);
  }
  return faces_hold() && (!mesh_.bounds().backward || pieces_hold());
}

bool DeferredProof::faces_hold() {
  for (const std::uint32_t i : alive_) {
    if (!changed_[i]) continue;
    const std::uint32_t f = faces_[i];
    const glm::uvec3& t = mesh_.triangle(f);
    const TriangleCertificate forward =
        mesh_.bounds().forward->narrowed(std::min({mesh_.share(t.x), mesh_.share(t.y), mesh_.share(t.z)}));
    const double distance = forward.bound_with_room({mesh_.position(t.x), mesh_.position(t.y), mesh_.position(t.z)},
                                                    {mesh_.distance_[t.x], mesh_.distance_[t.y], mesh_.distance_[t.z]});
    if (distance == TriangleCertificate::kUnproved) return false;
    mesh_.face_distance_[f] = distance;
  }
  return true;
}

std::uint32_t DeferredProof::successor(std::uint32_t place) const {
  while (successors_[place] != place) place = successors_[place];
  return place;
}

bool DeferredProof::pieces_hold() {
  constexpr double kAnywhere = std::numeric_limits<double>::infinity();
  std::vector<Coverage::Element> elements;
  std::vector<Coverage::Removed> removed;
  for (const std::uint32_t i : alive_) {
    const glm::uvec3& t = mesh_.triangle(faces_[i]);
    elements.push_back(
        {faces_[i], {mesh_.position(t.x), mesh_.position(t.y), mesh_.position(t.z)}, changed_[i] ? kAnywhere : 0});
  }
  for (std::uint32_t i = 0; i < faces_.size(); ++i) {
    if (successors_[i] != i) removed.push_back({faces_[i], rank_[successor(i)], kAnywhere});
  }
  Coverage::Trial trial;
  if (!mesh_.bounds().backward->try_change(elements, removed, trial)) return false;
  mesh_.bounds().backward->commit(trial);
  return true;
}

void DeferredProof::take_back() {
  Kernel& kernel = mesh_.mesh_;
  for (const SavedHalfedge& s : saved_halfedges_) {
    kernel.halfedge(s.halfedge) = s.kernel;
    kernel.status(s.halfedge).set_deleted(false);
    kernel.status(kernel.edge_handle(s.halfedge)).set_deleted(false);
  }
  for (const SavedHalfedge& s : saved_halfedges_) {  // sets what its neighbours name, too
    kernel.set_next_halfedge_handle(s.halfedge, kernel.next_halfedge_handle(s.halfedge));
    kernel.set_next_halfedge_handle(kernel.prev_halfedge_handle(s.halfedge), s.halfedge);
  }
  for (const SavedAnchor& s : saved_anchors_) kernel.set_halfedge_handle(BoundedMesh::handle(s.vertex), s.halfedge);
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const std::uint32_t f = faces_[i];
    const SavedFace& s = saved_faces_[i];
    if (mesh_.alive(f)) {
      mesh_.count_around(mesh_.triangles_[f], -1);
    } else {
      ++mesh_.triangle_count_;
    }
    mesh_.count_around(s.triangle, 1);
    kernel.face(BoundedMesh::face(f)) = s.kernel;
    kernel.status(BoundedMesh::face(f)).set_deleted(false);
    mesh_.triangles_[f] = s.triangle;
    mesh_.corner_source_[f] = s.corner_source;
    mesh_.face_distance_[f] = s.distance;
    if (!mesh_.wedges_.empty()) mesh_.wedges_[f] = s.wedges;
  }
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const std::uint32_t v = vertices_[i];
    const SavedVertex& s = saved_vertices_[i];
    kernel.status(BoundedMesh::handle(v)).set_deleted(false);
    mesh_.positions_[v] = s.position.position, mesh_.stored_[v] = s.position.stored;
    mesh_.distance_[v] = s.distance;
    if (!mesh_.shares_.empty()) mesh_.shares_[v] = s.share;
    mesh_.left_original_[v] = s.left_original;
    mesh_.merged_into_[v] = v;
    collapse_.set_quadric(v, s.quadric);
  }
}

}  // namespace tolvol
