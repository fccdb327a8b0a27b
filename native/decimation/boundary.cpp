// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/boundary.h"

#include <limits>
#include <numeric>

#include "base/call.h"

namespace tolvol {

BoundaryBounds::BoundaryBounds(const ToleranceVolume& volume, const CutMesh& mesh,
                               std::span<const glm::dvec3> positions, bool boundary_is_of_reference, double limit,
                               double provable, Team& team) {
  if (mesh.boundary.empty()) return;
  if (boundary_is_of_reference) {
    reference_.vertices.assign(positions.begin(), positions.end());
    for (const glm::uvec2& e : mesh.boundary) reference_.triangles.emplace_back(e.x, e.y, e.y);
  } else {
    const TriangleMesh& whole = volume.reference();
    const CutMesh cut = cut_to_manifold(whole.vertices, whole.triangles, team);
    reference_.vertices = whole.vertices;
    for (const glm::uvec2& e : cut.boundary) {
      const std::uint32_t a = cut.vertex_input[e.x], b = cut.vertex_input[e.y];
      reference_.triangles.emplace_back(a, b, b);
    }
    if (reference_.triangles.empty()) {
      // The boundary stays as it is, because there is nothing that it could be near to.
      for (const glm::uvec2& e : mesh.boundary) uncertified_.insert(uncertified_.end(), {e.x, e.y});
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
  for (const glm::uvec2& e : mesh.boundary) {
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
