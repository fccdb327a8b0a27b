// SPDX-License-Identifier: GPL-3.0-or-later
/// How the triangles of a mesh are connected: whether they bound a solid, and if not, how often they do not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"

namespace tolvol {

/// Counts over the triangles whose corners are at three different positions. Vertices at the same position are one.
struct Solidity {
  std::size_t open_edges = 0;             ///< of one triangle
  std::size_t boundary_loops = 0;         ///< groups of open edges that touch
  std::size_t non_manifold_edges = 0;     ///< of more than two triangles
  std::size_t non_manifold_vertices = 0;  ///< where the triangles do not all hang together by edges
  std::size_t misoriented_edges = 0;      ///< of two triangles that both run through them in the same direction
  std::size_t degenerate_triangles = 0;   ///< the triangles that are not counted
  std::size_t shells = 0;                 ///< groups of triangles that hang together by edges
  /// For each triangle, the first of its shell; a triangle that is not counted is alone.
  std::vector<std::uint32_t> shell_of;

  bool closed() const { return open_edges == 0 && shells > 0; }
  bool manifold() const { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
  bool oriented() const { return misoriented_edges == 0; }
};

/// Decides exactly by the coordinates as they are stored. The mesh must be valid. O(n + m).
Solidity solidity(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, Team& team);

}  // namespace tolvol
