// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/boundary.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <numeric>
#include <unordered_set>
#include <utility>

#include "base/call.h"
#include "topology/sides.h"

namespace tolvol {
namespace {

struct Boundary {
  std::vector<glm::uvec2> edges;       ///< in the direction of their triangle
  std::vector<std::uint32_t> strange;  ///< ends of the edges that lie on others
};

/// The open edges of a cut mesh, without those that lie on others by position: where an edge was cut, and where a sheet
/// with vertices of its own ends on other triangles. Where a sheet loses a triangle at an edge that lies on another, it
/// gets a boundary that the surface has not.
Boundary boundary_of(const CutMesh& cut, Team& team) {
  Boundary boundary;
  if (cut.boundary.empty()) return boundary;
  const auto vertex = [&](Side corner) { return cut.triangles[corner / 3][static_cast<int>(corner % 3)]; };
  const auto place = [&](Side corner) { return cut.copies_of[vertex(corner)]; };
  std::vector<Side> sides(cut.mates.size());
  std::iota(sides.begin(), sides.end(), 0u);
  std::unordered_set<std::uint64_t> shared;
  by_ends(sides, cut.copies_of.size(), team, place, [&](const std::vector<Side>& alike) {
    if (alike.size() == 1 || (alike.size() == 2 && cut.mates[alike[0]] == alike[1])) return;
    shared.insert(pair_key(place(alike[0]), place(next_corner(alike[0]))));
    for (const Side s : alike) boundary.strange.insert(boundary.strange.end(), {vertex(s), vertex(next_corner(s))});
  });
  std::ranges::copy_if(cut.boundary, std::back_inserter(boundary.edges), [&](const glm::uvec2& e) {
    return !shared.contains(pair_key(cut.copies_of[e.x], cut.copies_of[e.y]));
  });
  return boundary;
}

}  // namespace

BoundaryBounds::BoundaryBounds(const ToleranceVolume& volume, const CutMesh& mesh,
                               std::span<const glm::dvec3> positions, bool boundary_is_of_reference, double limit,
                               double provable, Team& team) {
  auto [boundary, strange] = boundary_of(mesh, team);
  if (boundary.empty()) return;
  strange_ = std::move(strange);
  if (boundary_is_of_reference) {
    reference_.vertices.assign(positions.begin(), positions.end());
    for (const glm::uvec2& e : boundary) reference_.triangles.emplace_back(e.x, e.y, e.y);
  } else {
    const TriangleMesh& whole = volume.reference();
    const CutMesh cut = cut_to_manifold(whole.vertices, whole.triangles, team);
    reference_.vertices = whole.vertices;
    for (const glm::uvec2& e : boundary_of(cut, team).edges) {
      const std::uint32_t a = cut.vertex_input[e.x], b = cut.vertex_input[e.y];
      reference_.triangles.emplace_back(a, b, b);
    }
    if (reference_.triangles.empty()) {
      // The boundary stays as it is, because there is nothing that it could be near to.
      for (const glm::uvec2& e : boundary) uncertified_.insert(uncertified_.end(), {e.x, e.y});
      return;
    }
  }
  hierarchy_.emplace(reference_);
  forward_.emplace(Witnesses(reference_), no_grid_, *hierarchy_, limit, limit);
  backward_.emplace(reference_, limit, positions.size());

  const TriangleCertificate start(Witnesses(reference_), no_grid_, *hierarchy_, provable, provable);
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
  const Coverage::Uncovered uncovered =
      backward_->find_witnesses(all, elements, ids, provable, static_cast<unsigned>(team.size()), nullptr);
  for (const std::uint32_t t : uncovered.nearest) {
    uncertified_.push_back(elements.triangles[t].x);
    uncertified_.push_back(elements.triangles[t].y);
  }
}

}  // namespace tolvol
