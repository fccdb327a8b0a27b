// SPDX-License-Identifier: GPL-3.0-or-later
/// Laplacian and bilaplacian smoothing, within a tolerance volume or without one.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "motion/constrain.h"

namespace tolvol {

struct SmoothingOptions {
  enum class Operator { laplacian, bilaplacian };
  enum class Weights { uniform, cotangent };
  enum class Boundary {
    fixed,
    along,  ///< Boundary vertices are smoothed along the boundary; its corners and branches stay.
  };

  unsigned iterations = 10;
  Operator kind = Operator::bilaplacian;
  Weights weights = Weights::cotangent;
  Boundary boundary = Boundary::fixed;
  std::span<const bool> locked = {};      ///< For each vertex, or empty: it stays where it is.
  std::span<const double> strength = {};  ///< For each vertex, or empty: the share, 0 to 1, of a full step.
  bool reset =
      false;  ///< a vertex that would leave the tolerance stays for this iteration, instead of being pulled back
  bool two_sided = true;             ///< Also keeps the whole reference within the tolerance of the mesh.
  Outside outside = Outside::error;  ///< What happens to a mesh that is not within the tolerance.
  PullBack::Crossings crossings = PullBack::Crossings::keep_out;  ///< It matters only with a volume.
  double max_normal_angle = 90;  ///< See ConstrainOptions; it matters only with a volume.
  unsigned threads = 0;          ///< 0 is one for each core. It never changes the result.
  Progress* progress = nullptr;
};

struct SmoothingResult {
  std::vector<glm::dvec3> vertices;    ///< In stored coordinates.
  std::vector<std::size_t> held_back;  ///< For each iteration: the number of vertices that did not go all the way.
  std::vector<std::size_t>
      kept_from_crossing;          ///< For each iteration: the number of these that went back so that no faces cross.
  double largest_motion = 0;       ///< In world units, from the input to the result.
  std::size_t welded = 0;          ///< The number of vertices treated as one with an earlier one at the same place.
  std::size_t fixed_boundary = 0;  ///< The number of vertices that stay because they are on the boundary.
  std::size_t fixed_non_manifold = 0;  ///< The number that stay because an edge there has more than two faces.
  std::size_t fixed_t_junctions = 0;   ///< The number of others that stay because they hold a T-junction together.
  FaceCount outside;                   ///< Input faces that are not within the tolerance and are kept as they are.
  FaceCount uncovered;                 ///< Faces of the reference that are not within the tolerance of the input.
  std::optional<Normals> normals;      ///< How the faces face the reference; none where no angle was kept.
  std::string method, renderer;        ///< The check that decided; empty without a volume.
  std::vector<std::string> warnings;
};

/// A step of a vertex is half the umbrella vector (the weighted mean of its neighbours less itself), or, bilaplacian,
/// less a quarter of the umbrella vector of these vectors: the largest at which no component of a shape overshoots. All
/// new positions are computed from the old ones, and vertices are pulled back (PullBack) until all promises hold, so
/// that every iteration ends inside. Unless `reset`: once an iteration has pulled a vertex back, its steps have a
/// limit, at first twice the way that it went, or a sixteenth of the tolerance if that is more. Each iteration that
/// does not pull it back doubles the limit. A longer step is shortened to the limit, and its vertex counts in
/// `held_back`. What holds T-junctions together (topology/t_junctions.h) stays. `volume` null: without bound, and bit
/// for bit what a volume that holds nothing back gives.
///
/// Throws InvalidInput for a bad mesh or bad arrays, naming the first offender, and like constrain(); Cancelled. About
/// 0.3 us an iteration and vertex, and 30 to 120 us for each that is held back; two-sided 1.1 to 1.3 times as much, and
/// more if it holds more vertices back. [M. Desbrun, M. Meyer, P. Schröder, A. H. Barr, Implicit Fairing of Irregular
/// Meshes using Diffusion and Curvature Flow, 1999], [Botsch04, §5].
SmoothingResult smooth(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                       const StoredSpace& space, const ToleranceVolume* volume, const SmoothingOptions& options);

}  // namespace tolvol
