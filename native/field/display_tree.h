// SPDX-License-Identifier: GPL-3.0-or-later
/// Signed distances from a reference, to show a mesh by in a viewport: exact at every place but for rounding, whatever
/// the tolerance. Nothing is interpolated, so that a thin or open sheet shows no more than there is; never for a check.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/progress.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

struct DisplayTree {
  /// The box of the triangles from `begin` to `end`, which are whole numbers: two texels of a shader.
  struct Node {
    glm::vec3 lower;
    float begin;
    glm::vec3 upper;
    float end;
  };
  /// Largest number of triangles: what a float counts exactly.
  static constexpr std::size_t kMost = std::size_t{1} << 24;
  /// Bound, in frame lengths, on the rounding of a distance in a shader near a reference of a size of about 1. What is
  /// nearer than this cannot be told from the reference.
  static constexpr double kRounding = 1e-6;

  bool closed;  ///< every edge of the reference has two faces, that agree on what is outside
  /// A full binary tree: the root is nodes[1], the halves of nodes[i] are nodes[2 i] and nodes[2 i + 1], the leaves are
  /// the last half. nodes[0] is not used.
  std::vector<Node> nodes;
  /// Three corners of each triangle, in the frame, in the order of the leaves, with the outside on their left-hand
  /// turn; w is 0.
  std::vector<glm::vec4> corners;

  /// For a valid reference in its frame, whose triangles run the other way round if it is `mirrored`. Of a closed
  /// reference the inside is what it encloses, whichever way its faces run. Throws InvalidInput above kMost triangles,
  /// Cancelled. O(m log m), 0.1 s for 270,000 triangles.
  DisplayTree(const TriangleMesh& reference, bool mirrored, Progress* progress = nullptr);

  /// The distance of a place in the frame, as shaders/surface_distance.glsl has it; `reach` where the reference is at
  /// least that far away. O(log m) for a place near the surface, about 1 us.
  double distance(const glm::dvec3& place, double reach) const;
};

/// Shares of the area of a mesh, its vertices given in the frame, with distances in the intervals that `edges`
/// (ascending) part: edges.size() + 1 numbers, together 1, or all 0 for a mesh without area. What is farther than all
/// edges on either side is in the last. By one sample a triangle and some 65,536 more. O(m log m), 0.3 s of one thread
/// for 270,000 triangles.
std::vector<double> area_shares(const DisplayTree& tree, std::span<const glm::dvec3> vertices,
                                std::span<const glm::uvec3> triangles, std::span<const double> edges,
                                unsigned threads = 0);

}  // namespace tolvol
