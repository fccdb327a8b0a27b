// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/filling_rules.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "check/input_checks.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {
namespace {

/// An edge across a hole is probed in so many points before any triangle at it is proved.
constexpr int kProbes = 7;

}  // namespace

FillingRules::FillingRules(const MeshView& mesh, std::vector<std::uint32_t> place, std::span<const Hole> holes,
                           const StoredSpace& space, const ToleranceVolume& volume, std::span<const double> shares,
                           double max_normal_angle, Team& team, std::vector<std::string>& warnings)
    : mesh_(mesh), place_(std::move(place)), space_(space), volume_(volume), shares_(shares) {
  std::vector<glm::dvec3> used;
  const std::vector<bool> is_used = used_vertices(mesh_.vertices.size(), mesh_.triangles);
  for (std::size_t v = 0; v < is_used.size(); ++v) {
    if (is_used[v]) used.push_back(mesh_.vertices[v]);
  }
  const double mapping_error = space_.mapping_error(used);
  certificate_.emplace(volume_.witnesses(), volume_.grid(), volume_.hierarchy(),
                       volume_.provable(mapping_error) * (1 - kHeadroom), volume_.refutable(mapping_error));
  facing_ = facing_rule(volume_, mapping_error, max_normal_angle, warnings, team);
  gather_faces(team);
  gather_edges(holes);
}

void FillingRules::gather_faces(Team& team) {
  std::vector<std::uint32_t> faces(mesh_.triangles.size());
  std::iota(faces.begin(), faces.end(), 0u);
  const auto corners = [&](std::size_t face) { return mesh_.corners(face); };
  faces_ = NearFaces(faces, corners, NearFaces::hubs_of(mesh_.triangles, mesh_.vertices.size()), team);
}

/// Only edges between two places at rims can be those of new faces.
void FillingRules::gather_edges(std::span<const Hole> holes) {
  std::vector<bool> at_rim(mesh_.vertices.size(), false);
  for (const Hole& hole : holes) {
    for (const std::uint32_t v : hole.corner) at_rim[place_[v]] = true;
  }
  for (std::uint32_t side = 0; side < 3 * mesh_.triangles.size(); ++side) {
    poll_at(side);
    const std::uint32_t a = place_[vertex_of(side)], b = place_[vertex_of(next_corner(side))];
    if (at_rim[a] && at_rim[b]) edges_.insert(pair_key(a, b));
  }
}

void FillingRules::measure(Hole& hole) const {
  for (const glm::dvec3& p : hole.at) hole.bounds.push_back(certificate_->point_bound(p));
  if (facing_) hole.reversed = looks_against(hole);
}

/// Whether over more of the rim all triangles of the reference look against the rim than all look as it does.
bool FillingRules::looks_against(const Hole& hole) const {
  double sum = 0;
  for (const Side side : hole.sides) {
    poll();
    const Corners stored = mesh_.corners(side / 3);
    const glm::dvec3 a = space_.frame(stored[0]), b = space_.frame(stored[1]), c = space_.frame(stored[2]);
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const auto is_there = [&](double sign) {
      const glm::dvec3 centre = (a + b + c) * (1.0 / 3);
      return facing_->nearest(volume_.hierarchy(), centre, sign * normal, kSameSide, certificate_->limit()).triangle !=
             Hierarchy::kNone;
    };
    const bool along = is_there(1), against = is_there(-1);
    if (along != against) sum += (along ? 1 : -1) * glm::length(normal);
  }
  return sum < 0;
}

std::optional<LoopOutcome> FillingRules::refusal_of_edge(const Hole& hole, std::uint32_t i, std::uint32_t j) const {
  if (place_[hole.corner[i]] == place_[hole.corner[j]]) return LoopOutcome::degenerate;
  if (edges_.contains(edge_of(hole, i, j))) return LoopOutcome::non_manifold;
  const double limit = std::min(share_at(hole, i), share_at(hole, j)) * certificate_->limit();
  for (int k = 1; k <= kProbes; ++k) {
    const double along = static_cast<double>(k) / (kProbes + 1);
    const glm::dvec3 p = (1 - along) * hole.at[i] + along * hole.at[j];
    if (!(certificate_->distance_bound(p) <= limit) &&
        volume_.hierarchy().nearest(p, limit).triangle == Hierarchy::kNone) {
      return LoopOutcome::outside;
    }
  }
  return std::nullopt;
}

std::optional<LoopOutcome> FillingRules::refusal_of_face(const Hole& hole, const glm::uvec3& face,
                                                         std::size_t& steps) const {
  if (is_degenerate(corners_of(hole, face))) return LoopOutcome::degenerate;
  const glm::dvec3 placed[3] = {hole.at[face.z], hole.at[face.y], hole.at[face.x]};
  std::optional<Facing> facing;
  if (facing_) {
    const std::optional<glm::dvec3> normal = sure_normal(placed[0], placed[1], placed[2], facing_->mesh_error);
    if (!normal) return LoopOutcome::turned;
    facing.emplace(*facing_, hole.reversed ? -*normal : *normal, facing_->angle);
  }
  const double share = std::min({share_at(hole, face.x), share_at(hole, face.y), share_at(hole, face.z)});
  if (!(share > 0)) return LoopOutcome::outside;
  const TriangleCertificate certificate = certificate_->narrowed(share);
  Facing* const rule = facing ? &*facing : nullptr;
  // Where triangles of the reference are near the point that has no witness, the rule does not admit them.
  const auto reason_at = [&](const glm::dvec3& p) {
    return rule && !certificate.is_open(p, nullptr) ? LoopOutcome::turned : LoopOutcome::outside;
  };
  if (const std::optional<glm::dvec3> point = certificate.point_outside(placed, rule)) return reason_at(*point);
  const TriangleCertificate::PointBound &a = hole.bounds[face.z], &b = hole.bounds[face.y], &c = hole.bounds[face.x];
  const glm::dvec3 bounds(a.distance, b.distance, c.distance);
  const glm::uvec3 no_hints(Hierarchy::kNone);
  if (rule) rule->set_corners({a.triangle, b.triangle, c.triangle});
  glm::dvec3 open;
  if (certificate.bound_in_any_order(placed, bounds, no_hints, rule, &open, &steps) == TriangleCertificate::kUnproved) {
    return reason_at(open);
  }
  return std::nullopt;
}

}  // namespace tolvol
