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
  /// What happens to a deformation that is not inside as a whole.
  enum class Mode {
    blocked,    ///< Nothing moves.
    farthest,   ///< Everything goes the same share of its way, the permitted fraction.
    pull_back,  ///< Each vertex goes as far as it may, see constrain.h.
  };
  enum class Outside { error, keep };

  Mode mode = Mode::blocked;
  Outside outside =
      Outside::error;    ///< With keep, vertices of faces that are outside to begin with stay where they are.
  unsigned threads = 0;  ///< 0 is one for each core. It never changes the result.
  Progress* progress = nullptr;
};

/// The number of some faces, and the first of them.
struct FaceCount {
  std::size_t faces = 0;
  std::optional<std::uint32_t> first;
};

struct DeformationResult {
  std::vector<glm::dvec3> vertices;  ///< In stored coordinates.
  /// The share of the way, from 0 to 1, at which the whole mesh is certified to be inside; 1 without a volume. It is
  /// not looked for when vertices are pulled back. Bisection finds it to a thousandth: a larger share may be inside as
  /// well, and smaller shares were not looked at.
  std::optional<double> permitted_fraction = 1;
  FaceCount leaving;  ///< Faces that the deformation as wished would not leave certified to be inside.
  FaceCount outside;  ///< Faces that are outside to begin with, which are kept as they are.
  std::size_t outside_lattice =
      0;                         ///< The number of vertices not in the box of the lattice, which stay where they are.
  std::size_t moved = 0;         ///< The number of vertices of the result that are not where they were.
  std::size_t held_back = 0;     ///< The number of vertices that did not go all their way.
  double largest_motion = 0;     ///< The largest motion of a vertex, in world units.
  std::string method, renderer;  ///< The check that decided; empty without a volume.
  std::vector<std::string> warnings;
};

/// `faces` has `corners` (1 to 4) indices for each face; without a volume it may be empty. Without a volume there is no
/// tolerance. All faces of the result are inside, except for the faces that are kept. Throws InvalidInput for bad
/// arrays, for a mesh that is outside to begin with (unless Outside::keep, or the deformation brings it inside), and
/// where the stored type cannot hold the tolerance; Cancelled. It takes about 0.4 us a vertex, and with a volume the
/// time of one check; where that check fails, of about twelve checks or of constrain().
DeformationResult deform(std::span<const glm::dvec3> vertices, std::span<const std::uint32_t> faces, int corners,
                         const StoredSpace& space, const ToleranceVolume* volume, const LatticeDeformation& lattice,
                         const DeformationOptions& options);

}  // namespace tolvol
