// SPDX-License-Identifier: GPL-3.0-or-later
/// Bounds any motion of a mesh: from a state that is inside a tolerance volume it goes towards a wished state as far as
/// the tolerance allows.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "check/outside.h"
#include "check/tolerance_volume.h"
#include "motion/pull_back.h"

namespace tolvol {

struct ConstrainOptions {
  PullBack::Mode mode = PullBack::Mode::pull_back;
  bool two_sided = true;             ///< Also keeps the whole reference within the tolerance of the mesh.
  Outside outside = Outside::error;  ///< What happens to a mesh that is not within the tolerance in `before`.
  PullBack::Crossings crossings = PullBack::Crossings::keep_out;
  /// In degrees, more than 0 and at most 180: every point of a face keeps a witness within the tolerance whose normal
  /// is within this angle of the face's (check/facing.h). 180 keeps no angle.
  double max_normal_angle = 90;
  unsigned threads = 0;  ///< 0 is one for each core. It never changes the result.
  Progress* progress = nullptr;
};

struct ConstrainResult {
  std::vector<glm::dvec3> vertices;    ///< In stored coordinates.
  std::vector<double> factors;         ///< The share, 0 to 1, of each vertex's motion from `before` to `after`.
  std::size_t held_back = 0;           ///< The number of factors below 1.
  std::size_t kept_from_crossing = 0;  ///< The number of these vertices that went back so that no faces cross.
  FaceCount outside;               ///< Faces of `before` that are not within the tolerance and are kept as they are.
  FaceCount uncovered;             ///< Faces of the reference that are not within the tolerance of `before`.
  std::optional<Normals> normals;  ///< How the faces face the reference; none where no angle was kept.
  std::string method, renderer;    ///< The check that decided.
  std::vector<std::string> warnings;
};

/// Vertex v ends at the stored rounding of before + f (after - before), f its factor: bit for bit `after` where f is 1
/// and `before` where f is 0. Every face of the result is inside as it is stored, corners with different factors
/// included. `faces` has `corners` (1 to 4) indices for each face, as in Pieces.
///
/// Vertices at one place in `before`, and at one place in `after`, have the same factor, so that soups and seams stay
/// whole. What holds a T-junction together (topology/t_junctions.h) does not move, and a warning counts it.
///
/// A vertex has factor 1 where neither it nor a vertex at its place touches a face that failed. One-sided, with
/// Mode::pull_back, and where crossings are allowed and no angle is kept, no single factor can rise by 1/64 alone (or
/// to 1, where that is less), and none is below that of Mode::reset, whose factors are 0 and 1. Two-sided, vertices go
/// back farther where the reference would lose its witness, by at least 1/16 of their way, and so they do where faces
/// would cross that do not cross in `before`, or would become degenerate.
///
/// Throws InvalidInput for bad arrays, naming the first offender, for a mesh that is not within the tolerance in
/// `before` (unless Outside::keep) and where the stored type cannot hold the tolerance; Cancelled. Starting costs what
/// PullBack::start() says, and the motion what PullBack::move() says.
ConstrainResult constrain(std::span<const glm::dvec3> before, std::span<const glm::dvec3> after,
                          std::span<const std::uint32_t> faces, int corners, const StoredSpace& space,
                          const ToleranceVolume& volume, const ConstrainOptions& options = {});

}  // namespace tolvol
