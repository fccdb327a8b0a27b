// SPDX-License-Identifier: GPL-3.0-or-later
/// Signed distances from a reference, by which a viewport shows a mesh. They are exact up to rounding at every place,
/// whatever the tolerance. Nothing is interpolated, so that a thin or open sheet is shown as it is. No check uses them.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/progress.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

struct DisplayTree {
  /// The box of the triangles from `begin` to `end`, which are whole numbers. A node is two texels of a shader.
  struct Node {
    glm::vec3 lower;
    float begin;
    glm::vec3 upper;
    float end;
  };
  /// The largest number of triangles, up to which a float counts exactly.
  static constexpr std::size_t kMost = std::size_t{1} << 24;
  /// A bound, in frame lengths, on the rounding of a distance in a shader near a reference of a size of about 1. A
  /// place that is nearer than this cannot be told from the reference.
  static constexpr double kRounding = 1e-6;

  bool closed;  ///< tells whether every edge of the reference has two faces, which agree on the outside
  /// A full binary tree. The root is nodes[1], the halves of nodes[i] are nodes[2 i] and nodes[2 i + 1], and the leaves
  /// are the last half. nodes[0] is not used.
  std::vector<Node> nodes;
  /// The three corners of each triangle, in the frame and in the order of the leaves, with the outside on their
  /// left-hand turn. Their w is 0.
  std::vector<glm::vec4> corners;

  /// The reference must be valid and in its frame. Its triangles run the other way round if it is `mirrored`. The
  /// inside of a closed reference is the space that it encloses, whichever way its faces run. Throws InvalidInput above
  /// kMost triangles, and Cancelled. O(m log m), 0.1 s for 270,000 triangles.
  DisplayTree(const TriangleMesh& reference, bool mirrored, Progress* progress = nullptr);

  /// Returns the distance of a place in the frame as shaders/surface_distance.glsl computes it, or `reach` if the
  /// reference is at least that far away. O(log m) for a place near the surface, about 1 us, but O(m) on a strip of
  /// needles that run aslant, whose boxes all meet there. Adds the number of nodes that were visited to `visited`.
  double distance(const glm::dvec3& place, double reach, std::size_t& visited) const;
  double distance(const glm::dvec3& place, double reach) const {
    std::size_t visited = 0;
    return distance(place, reach, visited);
  }
};

/// Returns the shares of the area of a mesh, whose vertices are in the frame, with distances in the intervals that
/// `edges` (ascending) separate. These are edges.size() + 1 numbers whose sum is 1, or all 0 for a mesh without area.
/// Area that is farther than all edges on either side counts to the last interval. There is one sample for each
/// triangle and about 65,536 more. Where searches visit very many nodes there are fewer, 256 or 255 at the least, and
/// many triangles have none. O(m log m), 0.3 s of one thread for 270,000 triangles. The searches visit about 17 million
/// nodes and 256 more for each triangle at the most: that took 4 s on two fans of 48,000 needles.
std::vector<double> area_shares(const DisplayTree& tree, std::span<const glm::dvec3> vertices,
                                std::span<const glm::uvec3> triangles, std::span<const double> edges,
                                unsigned threads = 0);

}  // namespace tolvol
