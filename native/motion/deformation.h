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
#include "motion/lattice.h"

namespace tolvol {

struct DeformationOptions {
  /// What becomes of a deformation that is not inside as a whole.
  enum class Mode {
    blocked,    ///< nothing moves
    farthest,   ///< everything goes the same share of its way: the permitted fraction
    pull_back,  ///< each vertex goes as far as it may, see constrain.h
  };
  enum class Outside { error, keep };

  Mode mode = Mode::blocked;
  Outside outside = Outside::error;  ///< keep: vertices of faces that are outside to begin with stay where they are
  unsigned threads = 0;              ///< 0: one per core; never changes the result
  Progress* progress = nullptr;
};

/// Faces by their number and the first of them.
struct FaceCount {
  std::size_t faces = 0;
  std::optional<std::uint32_t> first;
};

struct DeformationResult {
  std::vector<glm::dvec3> vertices;  ///< stored coordinates
  /// The share of the way, from 0 to 1, at which the whole mesh is certified to be inside; 1 without a volume; not
  /// looked for when vertices are pulled back. Found by bisection to a thousandth: what lies beyond may be inside as
  /// well, what lies before was not looked at.
  std::optional<double> permitted_fraction = 1;
  FaceCount leaving;                ///< of the deformation as wished: faces not certified to be inside
  FaceCount outside;                ///< faces that are outside to begin with, kept as they are
  std::size_t outside_lattice = 0;  ///< vertices not in the box of the lattice, which stay where they are
  std::size_t moved = 0;            ///< vertices of the result that are not where they were
  std::size_t held_back = 0;        ///< vertices that did not go all their way
  double largest_motion = 0;        ///< of a vertex of the result, world units
  std::string method, renderer;     ///< of the check that bounded it; empty without a volume
  std::vector<std::string> warnings;
};

/// `faces`: `corners` (1 to 4) a face; without a volume they may be empty. `volume` null: no tolerance. All faces of
/// the result are inside, but for those kept. Throws InvalidInput for bad arrays, for a mesh that is outside to begin
/// with (unless Outside::keep, or the deformation brings it inside), and where the stored type cannot hold the
/// tolerance; Cancelled. About 0.4 us a vertex, and with a volume one check; when that fails some twelve, or
/// constrain().
DeformationResult deform(std::span<const glm::dvec3> vertices, std::span<const std::uint32_t> faces, int corners,
                         const StoredSpace& space, const ToleranceVolume* volume, const LatticeDeformation& lattice,
                         const DeformationOptions& options);

}  // namespace tolvol
