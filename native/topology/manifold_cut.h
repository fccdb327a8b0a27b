// SPDX-License-Identifier: GPL-3.0-or-later
/// Turns any triangle soup into an oriented manifold with boundary that a half-edge kernel can hold, and counts the
/// repairs.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"

namespace tolvol {

/// The reason why a vertex of the cut mesh is tied to others, its copies, which are at the same place. Copies move and
/// vanish together (non_manifold), or must neither move nor vanish (degenerate).
enum class CutCause : std::uint8_t { none, non_manifold, degenerate };

struct CutMesh {
  // These members are the manifold.
  std::vector<glm::uvec3> triangles;  ///< have vertices of the manifold and are consistently oriented
  /// Holds for each side the side joined to it, or kNone. A side is the edge of triangle side / 3 from corner side % 3
  /// to the next corner.
  std::vector<std::uint32_t> mates;
  std::vector<std::uint32_t> triangle_input;  ///< is the input triangle of each triangle
  std::vector<bool> reversed;                 ///< tells for each triangle whether its corners 1 and 2 are swapped
  std::vector<std::uint32_t> vertex_input;    ///< is the lowest input vertex that each vertex stands for
  std::vector<CutCause> cause;                ///< has one entry for each vertex
  std::vector<glm::uvec2> boundary;           ///< are open edges, in the direction of their triangle, without cut edges
  // These members lead back to the input.
  std::vector<std::uint32_t> copies_of;     ///< is equal for copies: one of them. A vertex without copies has its own
  std::vector<std::uint32_t> output_slot;   ///< is equal for vertices, copies all, that are one vertex of the input
  std::vector<std::uint32_t> input_vertex;  ///< is the manifold vertex of each input vertex, kNone if it is not used
  std::vector<std::uint32_t> aside;         ///< are input triangles, in rising order, that no manifold holds; they stay
  std::vector<std::uint32_t> stand_in;      ///< is for each input triangle the one that holds its points, mostly itself
  // These members count the repairs.
  std::size_t duplicates = 0;  ///< counts dropped triangles on the vertices, or the positions in turn, of another
  std::size_t degenerate_on_edge = 0;  ///< counts degenerate triangles on another's edge, which are dropped
  std::size_t welded = 0;              ///< counts input vertices that were joined to another at exactly their position
  std::size_t cut_edges = 0;           ///< counts cut edges of more than two triangles or without a fitting orientation
  std::size_t reversed_count = 0;      ///< counts triangles against their neighbours, as they are in the result
  std::size_t double_sheet_faces = 0;  ///< counts triangles at exactly the positions of another one

  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
};

/// Joins triangles across edges by vertex index first and, where that leaves an edge open, by exactly equal position,
/// so that soups and seam splits decimate without cracks. Edges of more than two triangles are cut. Vertices at exactly
/// the same position are copies, also of sheets that merely touch: those stay several vertices, but at one place.
/// Inside of sheets that lie on each other, edge on edge, they are no copies; where these part they are. O(m) expected.
/// After A. Guéziec et al., "Cutting and stitching: converting sets of polygons to manifold surfaces", 2001. The same
/// on any number of threads.
CutMesh cut_to_manifold(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, Team& team);

}  // namespace tolvol
