// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/boundary.h"

#include <limits>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "base/call.h"
#include "topology/sides.h"

namespace tolvol {
namespace {

struct Boundary {
  std::vector<glm::uvec2> edges;       ///< in the direction of their triangle
  std::vector<std::uint32_t> strange;  ///< ends of other open edges of the manifold, and of edges that lie on others
};

std::uint64_t directed(const glm::uvec2& e) { return (static_cast<std::uint64_t>(e.x) << 32) | e.y; }

/// The edges of a cut mesh that have one triangle, by position. The manifold has other open edges: those that were cut,
/// and those in which a sheet with vertices of its own ends on edges of other triangles.
Boundary boundary_of(const CutMesh& cut) {
  const auto place = [&](const glm::uvec2& e) { return pair_key(cut.copies_of[e.x], cut.copies_of[e.y]); };
  const auto edge = [&](std::size_t t, int k) {
    return glm::uvec2(cut.triangles[t][k], cut.triangles[t][(k + 1) % 3]);
  };
  std::unordered_map<std::uint64_t, std::uint32_t> triangles_at;
  for (const glm::uvec2& e : cut.boundary) triangles_at.emplace(place(e), 0);
  Boundary boundary;
  if (triangles_at.empty()) return boundary;
  for (std::size_t t = 0; t < cut.triangles.size(); ++t) {
    poll_at(t);
    for (int k = 0; k < 3; ++k) {
      const auto found = triangles_at.find(place(edge(t, k)));
      if (found != triangles_at.end()) ++found->second;
    }
  }
  std::unordered_set<std::uint64_t> kept;
  for (const glm::uvec2& e : cut.boundary) {
    if (triangles_at.at(place(e)) > 1) continue;
    boundary.edges.push_back(e);
    kept.insert(directed(e));
  }
  // Where a sheet loses a triangle at an edge that lies on one of another sheet, it has a boundary that the surface has
  // not: one end of such an edge at least has copies.
  std::unordered_map<std::uint64_t, glm::uvec2> first_at;
  for (std::size_t side = 0; side < cut.mates.size(); ++side) {
    poll_at(side);
    const glm::uvec2 e = edge(side / 3, static_cast<int>(side % 3));
    if (cut.mates[side] == CutMesh::kNone && !kept.contains(directed(e))) {
      boundary.strange.insert(boundary.strange.end(), {e.x, e.y});
    }
    if (cut.cause[e.x] == CutCause::none && cut.cause[e.y] == CutCause::none) continue;
    const glm::uvec2 other = first_at.try_emplace(place(e), e).first->second;
    if (pair_key(other.x, other.y) != pair_key(e.x, e.y)) {
      boundary.strange.insert(boundary.strange.end(), {e.x, e.y, other.x, other.y});
    }
  }
  return boundary;
}

}  // namespace

BoundaryBounds::BoundaryBounds(const ToleranceVolume& volume, const CutMesh& mesh,
                               std::span<const glm::dvec3> positions, bool boundary_is_of_reference, double limit,
                               double provable, Team& team) {
  const auto [boundary, strange] = boundary_of(mesh);
  if (boundary.empty()) return;
  strange_ = strange;
  if (boundary_is_of_reference) {
    reference_.vertices.assign(positions.begin(), positions.end());
    for (const glm::uvec2& e : boundary) reference_.triangles.emplace_back(e.x, e.y, e.y);
  } else {
    const TriangleMesh& whole = volume.reference();
    const CutMesh cut = cut_to_manifold(whole.vertices, whole.triangles, team);
    reference_.vertices = whole.vertices;
    for (const glm::uvec2& e : boundary_of(cut).edges) {
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
