// SPDX-License-Identifier: GPL-3.0-or-later
#include "operation/boundary.h"

#include <algorithm>
#include <limits>

namespace tolvol {
namespace {

/// Edges of exactly one triangle, as (triangle corner, next corner) in the triangle's direction.
std::vector<std::pair<std::uint32_t, std::uint32_t>> open_edges(std::span<const glm::uvec3> triangles) {
  struct Side {
    std::uint64_t key;
    std::uint32_t from, to;
  };
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (const glm::uvec3& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (a != b) sides.push_back({(static_cast<std::uint64_t>(std::min(a, b)) << 32) | std::max(a, b), a, b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.key != b.key ? a.key < b.key : a.from < b.from;
  });
  std::vector<std::pair<std::uint32_t, std::uint32_t>> open;
  for (std::size_t begin = 0, end; begin < sides.size(); begin = end) {
    for (end = begin + 1; end < sides.size() && sides[end].key == sides[begin].key;) ++end;
    if (end - begin == 1) open.emplace_back(sides[begin].from, sides[begin].to);
  }
  return open;
}

}  // namespace

BoundaryBounds::BoundaryBounds(const ToleranceVolume& volume, const CutMesh& mesh, std::span<const glm::dvec3> positions,
                               double within, double provable) {
  const TriangleMesh& whole = volume.reference();
  const std::vector<std::uint32_t> weld = weld_equal_positions(whole.vertices);
  std::vector<glm::uvec3> welded;
  welded.reserve(whole.triangles.size());
  for (const glm::uvec3& t : whole.triangles) welded.emplace_back(weld[t.x], weld[t.y], weld[t.z]);
  const auto of_reference = open_edges(welded);
  const auto of_mesh = open_edges(mesh.triangles);
  if (of_reference.empty() || of_mesh.empty()) return;

  reference_.vertices = whole.vertices;
  for (const auto& [a, b] : of_reference) reference_.triangles.emplace_back(a, b, b);
  hierarchy_.emplace(reference_);
  forward_.emplace(reference_, no_grid_, *hierarchy_, within, within);
  backward_.emplace(reference_, within, positions.size());

  const TriangleCertificate start(reference_, no_grid_, *hierarchy_, provable, provable);
  const glm::dvec3 unknown(std::numeric_limits<double>::infinity());
  TriangleMesh elements{{positions.begin(), positions.end()}, {}};
  std::vector<std::uint32_t> ids;
  for (const auto& [a, b] : of_mesh) {
    // Edges cut open are no boundary of the reference; their ends are held in place anyhow.
    if (mesh.cause[a] != CutCause::none && mesh.cause[b] != CutCause::none) continue;
    elements.triangles.emplace_back(a, b, b);
    // A boundary edge runs against its triangle, and is named by the vertex it starts from.
    ids.push_back(b);
    if (!start.inside({positions[a], positions[b], positions[b]}, unknown)) {
      uncertified_.push_back(a);
      uncertified_.push_back(b);
    }
  }
  if (elements.triangles.empty()) return;
  const Hierarchy near(elements);
  std::vector<std::uint32_t> nearest;
  for (std::uint32_t i = 0; i < reference_.triangles.size(); ++i) backward_->assign(i, near, ids, provable, nearest);
  for (const std::uint32_t t : nearest) {
    uncertified_.push_back(elements.triangles[t].x);
    uncertified_.push_back(elements.triangles[t].y);
  }
}

}  // namespace tolvol
