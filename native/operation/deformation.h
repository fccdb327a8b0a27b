// SPDX-License-Identifier: GPL-3.0-or-later
/// Freeform deformation of a mesh within a tolerance [Botsch et al., GPU-based Tolerance Volumes for Mesh Processing,
/// 2004, section 5].
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "check/tolerance_volume.h"
#include "operation/lattice.h"

namespace tolvol {

struct DeformationOptions {
  /// What becomes of a deformation that is not inside as a whole.
  enum class Mode {
    blocked,   ///< nothing moves
    farthest,  ///< everything goes the same share of its way: the permitted fraction
  };

  Mode mode = Mode::blocked;
  unsigned threads = 0;  ///< 0: one per core; never changes the result
  Progress* progress = nullptr;
};

struct DeformationResult {
  std::vector<glm::dvec3> vertices;  ///< stored coordinates
  /// The share of the way, from 0 to 1, at which the whole mesh is certified to be inside; 1 without a volume. Found by
  /// bisection: what lies beyond may be inside as well, what lies before was not looked at.
  double permitted_fraction = 1;
  std::size_t outside_faces = 0;  ///< of the deformation as wished: faces not certified to be inside
  std::optional<std::uint32_t> first_outside;
  std::size_t outside_lattice = 0;  ///< vertices not in the box of the lattice, which stay where they are
  std::size_t moved = 0;            ///< vertices of the result that are not where they were
  double largest_motion = 0;        ///< of a vertex of the result, world units
  std::string method, renderer;     ///< of the check that bounded it; empty without a volume
  std::vector<std::string> warnings;
};

/// `faces`: `corners` (1 to 4) a face; without a volume they may be empty. `volume` null: no tolerance. The result as a
/// whole is inside, or it is what came in. Throws InvalidInput for bad arrays or a bad lattice, for a mesh that is not
/// inside to begin with where the deformation is not inside either, and where the stored type cannot hold the
/// tolerance; Cancelled. About 0.3 us a vertex, and with a volume one check, or some twelve when it is not inside.
DeformationResult deform(std::span<const glm::dvec3> vertices, std::span<const std::uint32_t> faces, int corners,
                         const Placement& placement, const ToleranceVolume* volume, const LatticeDeformation& lattice,
                         const DeformationOptions& options);

}  // namespace tolvol
