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

#include "check/outside.h"
#include "check/tolerance_volume.h"
#include "motion/lattice.h"
#include "motion/pull_back.h"

namespace tolvol {

struct DeformationOptions {
  /// What happens to a deformation that is not inside as a whole.
  enum class Mode {
    blocked,    ///< Nothing moves.
    farthest,   ///< Everything goes the same share of its way, the permitted fraction.
    pull_back,  ///< Each vertex goes as far as it may, see constrain.h.
  };

  Mode mode = Mode::blocked;
  bool two_sided = true;             ///< Also keeps the whole reference within the tolerance of the mesh.
  Outside outside = Outside::error;  ///< What happens to a mesh that is not within the tolerance to begin with.
  PullBack::Crossings crossings = PullBack::Crossings::keep_out;  ///< It matters only with a volume.
  double max_normal_angle = 90;  ///< See ConstrainOptions; it matters only with a volume.
  unsigned threads = 0;          ///< 0 is one for each core. It never changes the result.
  Progress* progress = nullptr;
};

struct DeformationResult {
  std::vector<glm::dvec3> vertices;  ///< In stored coordinates.
  /// The share of the way, from 0 to 1, at which the whole mesh is certified to be inside and no faces are turned or
  /// cross that must not; 1 without a volume. It is not looked for when vertices are pulled back. Bisection finds it to
  /// a thousandth: a larger share may be permitted as well, and smaller shares were not looked at.
  std::optional<double> permitted_fraction = 1;
  /// Faces that the deformation as wished would not leave certified to be inside or, if there are none, some that it
  /// would take from a part of the reference that has no other face within the tolerance.
  FaceCount leaving;
  /// If no faces are leaving: those that would exceed the angle to the reference by the deformation as wished.
  FaceCount turning;
  /// If no faces are leaving or turning: those that would cross others anew, or become degenerate, by the deformation
  /// as wished.
  FaceCount crossing;
  FaceCount outside;    ///< Faces that are outside to begin with, which are kept as they are.
  FaceCount uncovered;  ///< Faces of the reference that are not within the tolerance of the mesh to begin with.
  std::optional<Normals> normals;  ///< How the faces face the reference; none where no angle was kept.
  /// The number of vertices not in the box of the lattice, which stay where they are.
  std::size_t outside_lattice = 0;
  std::size_t moved = 0;      ///< The number of vertices of the result that are not where they were.
  std::size_t held_back = 0;  ///< The number of vertices that did not go all their way.
  /// When vertices are pulled back: the number of these that went back so that no faces cross.
  std::size_t kept_from_crossing = 0;
  double largest_motion = 0;     ///< The largest motion of a vertex, in world units.
  std::string method, renderer;  ///< The check that decided; empty without a volume.
  std::vector<std::string> warnings;
};

/// `faces` has `corners` (1 to 4) indices for each face; without a volume it may be empty. Without a volume there is no
/// tolerance. With one, vertices that hold T-junctions together stay, and a warning counts them; they move only with a
/// mesh that is not within the tolerance to begin with and is brought there as a whole. All faces of the result are
/// inside, and two-sided the reference is covered, except for what is kept. Unless they are allowed to, no faces exceed
/// the angle to the reference or cross that do not do so to begin with. Throws InvalidInput for bad arrays, for a mesh
/// that is not within the tolerance to begin with (unless Outside::keep, or the deformation brings it there without
/// faces that turn or cross anew), and where the stored type cannot hold the tolerance; Cancelled. It takes about 0.4
/// us a vertex, and with a volume the time of one check and of PullBack::start(); where that check fails, of about
/// twelve checks or of constrain().
DeformationResult deform(std::span<const glm::dvec3> vertices, std::span<const std::uint32_t> faces, int corners,
                         const StoredSpace& space, const ToleranceVolume* volume, const LatticeDeformation& lattice,
                         const DeformationOptions& options);

}  // namespace tolvol
