// SPDX-License-Identifier: GPL-3.0-or-later
/// The bounds of open boundaries, which a decimation keeps when it keeps only one direction of the surfaces: the
/// boundary edges of the mesh stay within the tolerance of the reference's boundary edges, and the reference's within
/// the tolerance of the mesh's.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "check/certificate.h"
#include "check/coverage.h"
#include "topology/manifold_cut.h"

namespace tolvol {

class BoundaryBounds {
 public:
  /// `limit` is the distance that collapses must keep; an edge nearer than `provable` counts as near at the start.
  /// `boundary_is_of_reference` says that every open edge of the mesh is an open edge of the reference, or a piece of
  /// one. Then these are the boundary of the reference: its other open edges were closed and count no more. An open
  /// edge that lies on edges of other triangles is no boundary, of the mesh or of the reference.
  BoundaryBounds(const ToleranceVolume& volume, const CutMesh& mesh, std::span<const glm::dvec3> positions,
                 bool boundary_is_of_reference, double limit, double provable, Team& team);
  BoundaryBounds(const BoundaryBounds&) = delete;
  BoundaryBounds& operator=(const BoundaryBounds&) = delete;

  /// Whether the mesh and the reference both have a boundary. If not, there is nothing to keep.
  bool any() const { return forward_.has_value(); }
  const TriangleCertificate& forward() const { return *forward_; }
  Coverage& backward() { return *backward_; }
  /// Vertices of the mesh at boundary edges for which the promise does not hold at the start, to be held in place.
  const std::vector<std::uint32_t>& uncertified() const { return uncertified_; }
  /// Vertices of the mesh at edges that lie on others, to be held in place.
  const std::vector<std::uint32_t>& strange() const { return strange_; }

 private:
  TriangleMesh reference_;  // It holds boundary edges as degenerate triangles (a, b, b).
  DistanceGrid no_grid_;    // It stays empty: the hierarchy finds the segments.
  std::optional<Hierarchy> hierarchy_;
  std::optional<TriangleCertificate> forward_;
  std::optional<Coverage> backward_;
  std::vector<std::uint32_t> uncertified_, strange_;
};

}  // namespace tolvol
