// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/boundary.h"

#include <limits>
#include <numeric>
#include <unordered_map>

#include "base/call.h"
#include "topology/sides.h"

namespace tolvol {
namespace {

/// The open edges of a mesh without those that lie on edges of other triangles. A sheet with vertices of its own ends
/// in such an edge, but the surface does not.
std::vector<glm::uvec2> boundary_of(const CutMesh& cut) {
  std::vector<glm::uvec2> boundary = cut.boundary;
  const auto place = [&](std::uint32_t a, std::uint32_t b) { return pair_key(cut.copies_of[a], cut.copies_of[b]); };
  std::unordered_map<std::uint64_t, std::uint32_t> triangles_at;
  for (const glm::uvec2& e : boundary) {
    if (cut.cause[e.x] != CutCause::none && cut.cause[e.y] != CutCause::none) triangles_at.emplace(place(e.x, e.y), 0);
  }
  if (triangles_at.empty()) return boundary;
  for (std::size_t t = 0; t < cut.triangles.size(); ++t) {
    poll_at(t);
    for (int k = 0; k < 3; ++k) {
      const auto found = triangles_at.find(place(cut.triangles[t][k], cut.triangles[t][(k + 1) % 3]));
      if (found != triangles_at.end()) ++found->second;
    }
  }
  std::erase_if(boundary, [&](const glm::uvec2& e) {
    const auto found = triangles_at.find(place(e.x, e.y));
    return found != triangles_at.end() && found->second > 1;
  });
  return boundary;
}

}  // namespace

BoundaryBounds::BoundaryBounds(const ToleranceVolume& volume, const CutMesh& mesh,
                               std::span<const glm::dvec3> positions, bool boundary_is_of_reference, double limit,
                               double provable, Team& team) {
  const std::vector<glm::uvec2> boundary = boundary_of(mesh);
  if (boundary.empty()) return;
  if (boundary_is_of_reference) {
    reference_.vertices.assign(positions.begin(), positions.end());
    for (const glm::uvec2& e : boundary) reference_.triangles.emplace_back(e.x, e.y, e.y);
  } else {
    const TriangleMesh& whole = volume.reference();
    const CutMesh cut = cut_to_manifold(whole.vertices, whole.triangles, team);
    reference_.vertices = whole.vertices;
    for (const glm::uvec2& e : boundary_of(cut)) {
      const std::uint32_t a = cut.vertex_input[e.x], b = cut.vertex_input[e.y];
      reference_.triangles.emplace_back(a, b, b);
    }
    if (reference_.triangles.empty()) {
      // The boundary stays as it is, because there is nothing that it could be near to.
      for (const glm::uvec2& e : boundary) uncertified_.insert(uncertified_.end(), {e.x, e.y});
      return;
    }
  }
  witnesses_ = prepare_witnesses(reference_);
  hierarchy_.emplace(reference_);
  forward_.emplace(witnesses_, no_grid_, *hierarchy_, limit, limit);
  backward_.emplace(reference_, limit, positions.size());

  const TriangleCertificate start(witnesses_, no_grid_, *hierarchy_, provable, provable);
  const glm::dvec3 unknown(std::numeric_limits<double>::infinity());
  TriangleMesh elements{{positions.begin(), positions.end()}, {}};
  std::vector<std::uint32_t> ids;
  for (const glm::uvec2& e : boundary) {
    poll_at(ids.size());
    const std::uint32_t a = e.x, b = e.y;
    elements.triangles.emplace_back(a, b, b);
    // A boundary edge runs against its triangle, and is named by the vertex it starts from.
    ids.push_back(b);
    if (start.bound({positions[a], positions[b], positions[b]}, unknown) == TriangleCertificate::kUnproved) {
      uncertified_.push_back(a);
      uncertified_.push_back(b);
    }
  }
  std::vector<std::uint32_t> all(reference_.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  const Coverage::Uncovered uncovered = backward_->find_witnesses(all, elements, ids, provable, nullptr);
  for (const std::uint32_t t : uncovered.nearest) {
    uncertified_.push_back(elements.triangles[t].x);
    uncertified_.push_back(elements.triangles[t].y);
  }
}

}  // namespace tolvol
