// SPDX-License-Identifier: GPL-3.0-or-later
/// What is promised of open boundaries when only one direction is kept: boundary edges stay within the tolerance of the
/// reference's boundary edges, and those within the tolerance of them.
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
  /// `limit`: what collapses must keep; `provable`: what counts as near at the start.
  BoundaryBounds(const ToleranceVolume& volume, const CutMesh& mesh, std::span<const glm::dvec3> positions,
                 bool mesh_is_reference, double limit, double provable, Team& team);
  BoundaryBounds(const BoundaryBounds&) = delete;
  BoundaryBounds& operator=(const BoundaryBounds&) = delete;

  /// Whether there is a boundary on both sides; else there is nothing to keep.
  bool any() const { return forward_.has_value(); }
  const TriangleCertificate& forward() const { return *forward_; }
  Coverage& backward() { return *backward_; }
  /// Vertices of the mesh at boundary edges for which the promise does not hold at the start, to be held in place.
  const std::vector<std::uint32_t>& uncertified() const { return uncertified_; }

 private:
  TriangleMesh reference_;  // boundary edges as degenerate triangles (a, b, b)
  std::vector<WitnessTriangle> witnesses_;
  DistanceGrid no_grid_;  // segments are found by the hierarchy
  std::optional<Hierarchy> hierarchy_;
  std::optional<TriangleCertificate> forward_;
  std::optional<Coverage> backward_;
  std::vector<std::uint32_t> uncertified_;
};

}  // namespace tolvol
