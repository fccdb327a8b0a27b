// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/certified_bounds.h"

#include <algorithm>
#include <limits>

#include "base/call.h"
#include "base/parallel.h"
#include "check/changed_faces.h"
#include "decimation/replaced_faces.h"

namespace tolvol {
namespace {

/// A thread takes so many vertices or faces at once: about a millisecond of searches between two polls.
constexpr std::size_t kAtOnce = 1024;

}  // namespace

CertifiedBounds::CertifiedBounds(const Directions& directions, MeshView mesh, Team& team,
                                 std::span<const std::uint32_t> on_reference)
    : directions_(directions), vertices_(mesh.vertices.size()), faces_(mesh.triangles.size()) {
  for (std::size_t f = 0; f < on_reference.size(); ++f) {
    if (on_reference[f] == Hierarchy::kNone) continue;
    faces_[f] = {0, 0};
    for (int k = 0; k < 3; ++k) vertices_[mesh.triangles[f][k]] = {0, on_reference[f]};
  }
  team.run(vertices_.size(), kAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      if (vertices_[v].triangle == Hierarchy::kNone) vertices_[v] = forward().point_bound(mesh.vertices[v]);
    }
  });
  if (!directions_.facing) return;
  rules_.assign(faces_.size(), {directions_.facing->angle, false, false});
  team.run(faces_.size(), kAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const auto [a, b, c] = mesh.corners(f);
      rules_[f].may_be_unsure = !sure_normal(a, b, c, directions_.facing->mesh_error);
    }
  });
}

bool CertifiedBounds::start(std::uint32_t triangle, const glm::dvec3 (&corners)[3],
                            std::optional<Facing>& facing) const {
  return !must_face(triangle) || start_facing(*directions_.facing, rules_[triangle], corners, facing);
}

FaceBound CertifiedBounds::prove(std::uint32_t triangle, const glm::dvec3 (&corners)[3], const PointBound (&known)[3],
                                 double share, Search search, glm::dvec3* open) const {
  std::optional<Facing> facing;
  if (!start(triangle, corners, facing)) return {};
  if (facing) facing->set_corners({known[0].triangle, known[1].triangle, known[2].triangle});
  Facing* const rule = facing ? &*facing : nullptr;
  const glm::dvec3 bounds(known[0].distance, known[1].distance, known[2].distance);
  const TriangleCertificate certificate = forward().narrowed(share);
  const double distance = search == Search::with_room ? certificate.bound_with_room(corners, bounds, rule)
                                                      : certificate.bound_in_any_order(
                                                            corners, bounds, glm::uvec3(Hierarchy::kNone), rule, open);
  return {distance, facing ? facing->angle() : std::numbers::pi};
}

CertifiedBounds::Saved CertifiedBounds::save(std::span<const std::uint32_t> vertices,
                                             std::span<const std::uint32_t> faces) const {
  Saved saved;
  for (const std::uint32_t v : vertices) saved.vertices.push_back(vertices_[v]);
  for (const std::uint32_t f : faces) saved.faces.push_back(faces_[f]);
  return saved;
}

void CertifiedBounds::restore(const Saved& saved, std::span<const std::uint32_t> vertices,
                              std::span<const std::uint32_t> faces) {
  for (std::size_t i = 0; i < vertices.size(); ++i) vertices_[vertices[i]] = saved.vertices[i];
  for (std::size_t i = 0; i < faces.size(); ++i) faces_[faces[i]] = saved.faces[i];
}

/// A trial that asks only where the vertex of a change is.
class CertifiedBounds::VertexTrial : public Trial {
 public:
  explicit VertexTrial(CertifiedBounds& bounds) : bounds_(bounds) {}
  bool accepts(const ChangedFaces& change) override { return vertex_is_inside(change) && seems_to_face(change); }
  void commit(const ChangedFaces& change) override {
    for (const std::uint32_t v : change.carried()) bounds_.note(v, vertex_bound_);
    for (const std::uint32_t v : change.moved_along()) bounds_.note(v, vertex_bound_);
    if (const auto v = change.vertex()) bounds_.note(*v, vertex_bound_);
  }

 protected:
  bool vertex_is_inside(const ChangedFaces& change) {
    vertex_bound_ = bounds_.forward().point_bound(change.position().position);
    return vertex_bound_.distance <= change.share() * bounds_.forward().limit();
  }

  bool seems_to_face(const ChangedFaces& change) const;

  CertifiedBounds& bounds_;
  PointBound vertex_bound_;  ///< An upper bound on the vertex's distance to the reference.
};

/// Whether each face is admitted by a triangle that bounds one of its corners. The proof of a whole region fails with
/// one face that is turned too far, and then all of the region is done again: asking here makes this rare.
bool CertifiedBounds::VertexTrial::seems_to_face(const ChangedFaces& change) const {
  for (std::size_t i = 0; i < change.elements().size(); ++i) {
    const Coverage::Element& element = change.elements()[i];
    if (element.moved == 0) continue;
    std::optional<Facing> facing;
    if (!bounds_.start(element.id, element.corners, facing)) return false;
    if (!facing) continue;
    const ChangedFaces::Face& face = change.faces()[i];
    const auto is_admitted = [&](int k) {
      const std::uint32_t below = (k == face.corner ? vertex_bound_ : bounds_.vertex_bound(face.vertices[k])).triangle;
      return below != Hierarchy::kNone && facing->admits(below);
    };
    if (!is_admitted(0) && !is_admitted(1) && !is_admitted(2)) return false;
  }
  return true;
}

/// A trial that asks for every bound, the cheapest question first.
class CertifiedBounds::FullTrial final : public VertexTrial {
 public:
  using VertexTrial::VertexTrial;
  void begin() override { failed_last_ = 0, backward_.begin(), boundary_backward_.begin(); }
  bool accepts(const ChangedFaces& change) override {
    Coverage* const backward = bounds_.backward();
    return (!change.vertex() || vertex_is_inside(change)) && !shows_outside(change) &&
           (!backward || backward->try_change(change.elements(), change.removed(), backward_)) &&
           faces_are_inside(change) && boundary_is_inside(change);
  }
  void commit(const ChangedFaces& change) override {
    VertexTrial::commit(change);
    if (Coverage* const backward = bounds_.backward()) backward->commit(backward_);
    if (Coverage* const boundary = bounds_.boundary_backward(); boundary && !change.boundary().elements.empty()) {
      boundary->commit(boundary_backward_);
    }
    for (std::size_t i = 0; i < face_bounds_.size(); ++i) {
      bounds_.note_face(change.elements()[i].id, face_bounds_[i]);
    }
  }
  std::size_t looked_at() const override { return backward_.looked_at(); }

 private:
  bool is_large(const Coverage::Element& e) const;
  bool shows_outside(const ChangedFaces& change);
  bool faces_are_inside(const ChangedFaces& change);
  bool face_is_inside(const ChangedFaces& change, std::size_t i);
  double turn(const ChangedFaces& change, std::size_t i, const Facing& facing) const;
  void gather_replaced_faces(const ChangedFaces& change);
  bool boundary_is_inside(const ChangedFaces& change);

  ReplacedFaces replaced_faces_;
  Coverage::Trial backward_, boundary_backward_;
  std::vector<FaceBound> face_bounds_;  ///< For each face of the change.
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
bool CertifiedBounds::FullTrial::shows_outside(const ChangedFaces& change) {
  const std::size_t count = change.elements().size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = (failed_last_ + k) % count;
    const Coverage::Element& element = change.elements()[i];
    if (element.moved == 0 || !is_large(element)) continue;
    if (bounds_.forward().narrowed(change.share(change.faces()[i])).point_outside(element.corners)) {
      failed_last_ = i;
      return true;
    }
  }
  return false;
}

bool CertifiedBounds::FullTrial::faces_are_inside(const ChangedFaces& change) {
  const std::size_t count = change.elements().size();
  replaced_faces_.clear();
  face_bounds_.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = (failed_last_ + k) % count;
    if (!face_is_inside(change, i)) {
      failed_last_ = i;
      return false;
    }
  }
  return true;
}

bool CertifiedBounds::FullTrial::face_is_inside(const ChangedFaces& change, std::size_t i) {
  const Coverage::Element& element = change.elements()[i];
  const ChangedFaces::Face& face = change.faces()[i];
  FaceBound& bound = face_bounds_[i];
  bound = bounds_.face_bound(element.id);
  if (element.moved == 0) return true;
  std::optional<Facing> facing;
  if (!bounds_.start(element.id, element.corners, facing)) return false;
  const double limit = bounds_.forward().narrowed(change.share(face)).limit();
  // No point of the face moves farther than its moving corner, and its witness stays.
  bound.distance += element.moved;
  if (bound.distance <= limit) {
    if (!facing) return true;
    bound.angle += turn(change, i, *facing);
    if (bound.angle <= facing->limit()) return true;
  }
  if (is_large(element)) {
    if (replaced_faces_.empty()) gather_replaced_faces(change);
    bound = replaced_faces_.bound(element.corners, limit, facing ? &*facing : nullptr);
    if (bound.distance <= limit) return true;
  }
  PointBound corners[3];
  for (int k = 0; k < 3; ++k) corners[k] = bounds_.vertex_bound(face.vertices[k]);
  if (change.vertex()) corners[face.corner] = vertex_bound_;
  bound = bounds_.prove(element.id, element.corners, corners, change.share(face), Search::with_room);
  return bound.distance != TriangleCertificate::kUnproved;
}

/// By how much a change turns a face at most.
double CertifiedBounds::FullTrial::turn(const ChangedFaces& change, std::size_t i, const Facing& facing) const {
  const Coverage::Element& element = change.elements()[i];
  glm::dvec3 before[3] = {element.corners[0], element.corners[1], element.corners[2]};
  before[change.faces()[i].corner] = change.faces()[i].before;
  std::optional<Facing> was;
  const bool known = bounds_.start(element.id, before, was) && was;
  return known ? angle_bound(glm::dot(was->normal(), facing.normal())) : std::numbers::pi;
}

void CertifiedBounds::FullTrial::gather_replaced_faces(const ChangedFaces& change) {
  const auto add = [&](std::uint32_t id) {
    const auto [a, b, c] = change.before().corners(id);
    const glm::dvec3 corners[3] = {a, b, c};
    std::optional<Facing> facing;
    bounds_.start(id, corners, facing);
    replaced_faces_.add(corners, bounds_.face_bound(id), facing ? std::optional(facing->normal()) : std::nullopt);
  };
  for (const Coverage::Element& e : change.elements()) add(e.id);
  for (const Coverage::Removed& r : change.removed()) add(r.id);
}

bool CertifiedBounds::FullTrial::boundary_is_inside(const ChangedFaces& change) {
  if (!bounds_.bounds_boundaries()) return true;
  const ChangedFaces::Boundary& boundary = change.boundary();
  if (boundary.lies_on_others) return false;
  if (boundary.elements.empty()) return true;
  const Directions& directions = bounds_.directions_;
  const glm::dvec3 unknown(std::numeric_limits<double>::infinity());
  for (const Coverage::Element& e : boundary.elements) {
    if (e.moved > 0 && directions.boundary_forward->bound(e.corners, unknown) == TriangleCertificate::kUnproved)
      return false;
  }
  return directions.boundary_backward->try_change(boundary.elements, boundary.removed, boundary_backward_);
}

}  // namespace tolvol
