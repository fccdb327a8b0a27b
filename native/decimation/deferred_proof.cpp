// SPDX-License-Identifier: GPL-3.0-or-later
// The collapses of a region change only the faces around its vertices, and the names of neighbours in the boundary
// halfedges beyond the region: these name the halfedges of the region that they follow or that follow them. No two
// regions change the same name, so that regions can be worked on, proved and put back side by side.
#include "decimation/deferred_proof.h"

#include <algorithm>
#include <limits>

namespace tolvol {

DeferredProof::DeferredProof(EdgeCollapse& collapse, BoundedMesh& mesh, NewCrossings* crossings,
                             std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces,
                             std::vector<std::uint32_t>& places)
    : collapse_(collapse),
      mesh_(mesh),
      bounds_(*mesh.certified()),
      crossings_(crossings),
      vertices_(vertices),
      faces_(faces),
      places_(places),
      saved_(mesh.save(vertices, faces)),
      saved_bounds_(bounds_.save(vertices, faces)),
      changed_(faces.size()),
      successors_(faces.size()) {
  for (std::uint32_t i = 0; i < faces.size(); ++i) places_[faces[i]] = successors_[i] = i;
  for (const std::uint32_t v : vertices) quadrics_.push_back(collapse.quadric(v));
  if (!crossings) return;
  for (const std::uint32_t f : faces) origins_.push_back(crossings->origins().state(f));
}

bool DeferredProof::possible() const {
  const OpenMesh::TriConnectivity& connectivity = mesh_.connectivity();
  return !bounds_.bounds_boundaries() ||
         std::ranges::none_of(faces_, [&](std::uint32_t f) { return connectivity.is_boundary(BoundedMesh::face(f)); });
}

void DeferredProof::note(const Change& change) {
  for (const Coverage::Element& e : change.elements()) {
    if (e.moved > 0) changed_[places_[e.id]] = true;
  }
  for (const Coverage::Removed& r : change.removed())
    successors_[places_[r.id]] = places_[change.elements()[r.successor].id];
  if (!crossings_) return;
  std::vector<NewCrossings::Removed> removed;
  gather_removed(change, removed);
  crossings_->hand_over(removed);
}

bool DeferredProof::holds(Surroundings* around) {
  alive_.clear();
  rank_.assign(faces_.size(), 0);
  for (std::uint32_t i = 0; i < faces_.size(); ++i) {
    if (!mesh_.alive(faces_[i])) continue;
    rank_[i] = static_cast<std::uint32_t>(alive_.size());
    alive_.push_back(i);
  }
  return faces_hold() && (!around || is_uncrossed(*around)) && (!bounds_.backward() || pieces_hold());
}

bool DeferredProof::is_uncrossed(Surroundings& around) const {
  around.renew();
  std::vector<std::uint32_t> changed;
  for (const std::uint32_t i : alive_) {
    if (changed_[i]) changed.push_back(faces_[i]);
  }
  return around.allow(changed);
}

bool DeferredProof::faces_hold() {
  for (const std::uint32_t i : alive_) {
    if (!changed_[i]) continue;
    const std::uint32_t f = faces_[i];
    const glm::uvec3& t = mesh_.triangle(f);
    const glm::dvec3 corners[3] = {mesh_.position(t.x), mesh_.position(t.y), mesh_.position(t.z)};
    const CertifiedBounds::PointBound known[3] = {bounds_.vertex_bound(t.x), bounds_.vertex_bound(t.y),
                                                  bounds_.vertex_bound(t.z)};
    const double share = std::min({mesh_.share(t.x), mesh_.share(t.y), mesh_.share(t.z)});
    const FaceBound bound = bounds_.prove(f, corners, known, share, CertifiedBounds::Search::with_room);
    if (bound.distance == TriangleCertificate::kUnproved) return false;
    bounds_.note_face(f, bound);
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
  if (!bounds_.backward()->try_change(elements, removed, trial)) return false;
  bounds_.backward()->commit(trial);
  return true;
}

void DeferredProof::take_back() {
  mesh_.restore(saved_);
  bounds_.restore(saved_bounds_, vertices_, faces_);
  for (std::size_t i = 0; i < vertices_.size(); ++i) collapse_.set_quadric(vertices_[i], quadrics_[i]);
  for (std::size_t i = 0; i < origins_.size(); ++i) crossings_->origins().restore(faces_[i], origins_[i]);
}

}  // namespace tolvol
