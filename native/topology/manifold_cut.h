// SPDX-License-Identifier: GPL-3.0-or-later
/// From any triangle soup to an oriented manifold with boundary that a half-edge kernel can hold, and what was done for
/// it.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"

namespace tolvol {

/// Why a vertex of the cut mesh is tied to others, its copies, which are one vertex again in the result. Copies move
/// and vanish together (non_manifold), or must neither move nor vanish (degenerate).
enum class CutCause : std::uint8_t { none, non_manifold, degenerate };

struct CutMesh {
  // The manifold.
  std::vector<glm::uvec3> triangles;  ///< vertices of the manifold; all consistently oriented
  /// Per side, which is the edge of triangle side / 3 from corner side % 3 to the next: the side joined to it, or
  /// kNone.
  std::vector<std::uint32_t> mates;
  std::vector<std::uint32_t> triangle_input;  ///< per triangle: the input triangle it is
  std::vector<bool> reversed;                 ///< per triangle: its corners 1 and 2 are swapped against the input
  std::vector<std::uint32_t> vertex_input;    ///< per vertex: the lowest input vertex it stands for
  std::vector<CutCause> cause;                ///< per vertex
  std::vector<glm::uvec2> boundary;           ///< open edges, in the direction of their triangle; edges cut are none
  // The way back.
  std::vector<std::uint32_t> output_slot;   ///< per vertex: vertices with equal slots are one vertex of the result
  std::vector<std::uint32_t> input_vertex;  ///< per input vertex: its manifold vertex; kNone: used by no triangle
  std::vector<std::uint32_t> aside;         ///< input triangles that no manifold holds; kept as they are
  std::vector<std::uint32_t>
      stand_in;  ///< per input triangle: the input triangle that holds its points (itself mostly)
  // What was done.
  std::size_t duplicates = 0;  ///< on the same three vertices, or positions in the same turn, as another; dropped
  std::size_t degenerate_on_edge = 0;  ///< degenerate triangles that lie on another triangle's edge, dropped
  std::size_t welded = 0;              ///< input vertices at exactly the position of another, joined to it for topology
  std::size_t cut_edges = 0;           ///< edges cut because more than two triangles meet there or no orientation fits
  std::size_t reversed_count = 0;      ///< triangles against their neighbours' orientation; they keep it in the result

  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
};

/// The next corner of the same triangle, and the next side: each side is named by the corner where it begins.
inline std::uint32_t next_corner(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

/// Joins triangles across edges by vertex index first and, where that leaves an edge open, by exactly equal position,
/// so that soups and seam splits decimate without cracks while sheets that merely touch stay apart. Edges of more than
/// two triangles are cut. O(m) expected. After A. Guéziec et al., "Cutting and stitching: converting sets of polygons
/// to manifold surfaces", 2001. The same on any number of threads.
CutMesh cut_to_manifold(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, Team& team);

}  // namespace tolvol
