// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/certified_bounds.h"

#include <algorithm>
#include <limits>

#include "base/call.h"
#include "decimation/change.h"
#include "decimation/replaced_faces.h"

namespace tolvol {

CertifiedBounds::CertifiedBounds(const Directions& directions, std::span<const glm::dvec3> positions,
                                 std::size_t triangle_count, bool on_reference)
    : directions_(directions),
      distance_(positions.size(), 0),
      face_distance_(triangle_count, on_reference ? 0 : TriangleCertificate::kUnproved) {
  for (std::size_t i = 0; i < positions.size() && !on_reference; ++i) {
    poll_at(i);
    distance_[i] = forward().distance_bound(positions[i]);
  }
}

CertifiedBounds::Saved CertifiedBounds::save(std::span<const std::uint32_t> vertices,
                                             std::span<const std::uint32_t> faces) const {
  Saved saved;
  for (const std::uint32_t v : vertices) saved.distance.push_back(distance_[v]);
  for (const std::uint32_t f : faces) saved.face_distance.push_back(face_distance_[f]);
  return saved;
}

void CertifiedBounds::restore(const Saved& saved, std::span<const std::uint32_t> vertices,
                              std::span<const std::uint32_t> faces) {
  for (std::size_t i = 0; i < vertices.size(); ++i) distance_[vertices[i]] = saved.distance[i];
  for (std::size_t i = 0; i < faces.size(); ++i) face_distance_[faces[i]] = saved.face_distance[i];
}

/// A trial that asks only where the vertex of a change is.
class CertifiedBounds::VertexTrial : public Trial {
 public:
  explicit VertexTrial(CertifiedBounds& bounds) : bounds_(bounds) {}
  bool accepts(const Change& change) override { return vertex_is_inside(change); }
  void commit(const Change& change) override {
    for (const std::uint32_t v : change.carried()) bounds_.distance_[v] = vertex_distance_;
    if (const auto v = change.vertex()) bounds_.distance_[*v] = vertex_distance_;
  }

 protected:
  bool vertex_is_inside(const Change& change) {
    vertex_distance_ = bounds_.forward().distance_bound(change.position().position);
    return vertex_distance_ <= change.share() * bounds_.forward().limit();
  }

  CertifiedBounds& bounds_;
  double vertex_distance_ = 0;  ///< An upper bound on the vertex's distance to the reference.
};

/// A trial that asks for every bound, the cheapest question first.
class CertifiedBounds::FullTrial final : public VertexTrial {
 public:
  using VertexTrial::VertexTrial;
  void begin() override { failed_last_ = 0, backward_.begin(), boundary_backward_.begin(); }
  bool accepts(const Change& change) override {
    Coverage* const backward = bounds_.backward();
    return (!change.vertex() || vertex_is_inside(change)) && !shows_outside(change) &&
           (!backward || backward->try_change(change.elements(), change.removed(), backward_)) &&
           faces_are_inside(change) && boundary_is_inside(change);
  }
  void commit(const Change& change) override {
    VertexTrial::commit(change);
    if (Coverage* const backward = bounds_.backward()) backward->commit(backward_);
    if (!boundary_elements_.empty()) bounds_.directions_.boundary_backward->commit(boundary_backward_);
    for (std::size_t i = 0; i < face_distances_.size(); ++i) {
      bounds_.face_distance_[change.elements()[i].id] = face_distances_[i];
    }
  }
  std::size_t looked_at() const override { return backward_.looked_at(); }

 private:
  bool is_large(const Coverage::Element& e) const;
  bool shows_outside(const Change& change);
  bool faces_are_inside(const Change& change);
  void gather_replaced_faces(const Change& change);
  void gather_boundary(const Change& change);
  bool boundary_is_inside(const Change& change);

  ReplacedFaces replaced_faces_;
  std::vector<Coverage::Element> boundary_elements_;
  std::vector<Coverage::Removed> boundary_removed_;
  Coverage::Trial backward_, boundary_backward_;
  std::vector<double> face_distances_;  ///< For each face of the change: an upper bound on its distance.
  /// The face that failed last: of another try at the same place it is the likeliest to fail.
  std::size_t failed_last_ = 0;
};

std::unique_ptr<Bounds::Trial> CertifiedBounds::trial() { return std::make_unique<FullTrial>(*this); }

std::unique_ptr<Bounds::Trial> CertifiedBounds::trial_on_trust() { return std::make_unique<VertexTrial>(*this); }

/// Whether a face is likely to lie near many triangles of the reference.
bool CertifiedBounds::FullTrial::is_large(const Coverage::Element& e) const {
  constexpr double kLarge = 8;  // A face is large if it is longer than so many times the tolerance.
  const double large = kLarge * bounds_.forward().limit();
  return longest_squared({{e.corners[0], e.corners[1], e.corners[2]}}) > large * large;
}

/// Whether a point of a large face is outside. It is asked before anything is proved in vain.
bool CertifiedBounds::FullTrial::shows_outside(const Change& change) {
  const std::size_t count = change.elements().size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = (failed_last_ + k) % count;
    const Coverage::Element& element = change.elements()[i];
    if (element.moved == 0 || !is_large(element)) continue;
    if (bounds_.forward().narrowed(change.share(change.faces()[i])).shows_outside(element.corners)) {
      failed_last_ = i;
      return true;
    }
  }
  return false;
}

bool CertifiedBounds::FullTrial::faces_are_inside(const Change& change) {
  const std::size_t count = change.elements().size();
  replaced_faces_.clear();
  face_distances_.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = (failed_last_ + k) % count;
    const Coverage::Element& element = change.elements()[i];
    const Change::Face& face = change.faces()[i];
    double& distance = face_distances_[i];
    const TriangleCertificate forward = bounds_.forward().narrowed(change.share(face));
    // No point of the face moves farther than its moving corner.
    distance = bounds_.face_distance(element.id) + element.moved;
    if (element.moved == 0 || distance <= forward.limit()) continue;
    if (is_large(element)) {
      if (replaced_faces_.empty()) gather_replaced_faces(change);
      distance = replaced_faces_.bound(element.corners, forward.limit());
      if (distance <= forward.limit()) continue;
    }
    glm::dvec3 corners(bounds_.distance(face.vertices[0]), bounds_.distance(face.vertices[1]),
                       bounds_.distance(face.vertices[2]));
    if (change.vertex()) corners[face.corner] = vertex_distance_;
    distance = forward.bound_with_room(element.corners, corners);
    if (distance == TriangleCertificate::kUnproved) {
      failed_last_ = i;
      return false;
    }
  }
  return true;
}

void CertifiedBounds::FullTrial::gather_replaced_faces(const Change& change) {
  const BoundedMesh& mesh = change.mesh();
  const auto add = [&](std::uint32_t id) {
    const glm::uvec3& t = mesh.triangle(id);
    replaced_faces_.add(mesh.position(t.x), mesh.position(t.y), mesh.position(t.z), bounds_.face_distance(id));
  };
  for (const Coverage::Element& e : change.elements()) add(e.id);
  for (const Coverage::Removed& r : change.removed()) add(r.id);
}

/// Gathers the boundary edges as a collapse would leave them.
void CertifiedBounds::FullTrial::gather_boundary(const Change& change) {
  boundary_elements_.clear(), boundary_removed_.clear();
  if (!bounds_.bounds_boundaries()) return;
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

bool CertifiedBounds::FullTrial::boundary_is_inside(const Change& change) {
  gather_boundary(change);
  if (boundary_elements_.empty()) return true;
  const Directions& directions = bounds_.directions_;
  const glm::dvec3 unknown(std::numeric_limits<double>::infinity());
  for (const Coverage::Element& e : boundary_elements_) {
    if (e.moved > 0 && directions.boundary_forward->bound(e.corners, unknown) == TriangleCertificate::kUnproved)
      return false;
  }
  return directions.boundary_backward->try_change(boundary_elements_, boundary_removed_, boundary_backward_);
}

}  // namespace tolvol
