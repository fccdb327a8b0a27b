// SPDX-License-Identifier: GPL-3.0-or-later
/// Signed distances to show a mesh by, in pictures and in viewports [Botsch04, §3]: interpolated, and therefore never
/// for a check.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "field/distance_grid.h"
#include "reference/progress.h"

namespace tolvol {

struct DisplayGrid {
  struct Options {
    double precision = 4;  ///< nodes per tolerance, unless that is more nodes than:
    int longest = 2048;    ///< along an axis: what every GL 4 takes in a 3D texture
    std::size_t nodes = kGridBudget / (sizeof(float) + sizeof(std::uint32_t));  ///< in all
    unsigned threads = 0;
    Progress* progress = nullptr;
  };
  /// Nodes per tolerance from which on distances may be interpolated; a coarser grid makes up too much at edges.
  static constexpr double kInterpolated = 2;

  DistanceGrid grid;  ///< distances in units of its spacing, negative inside
  bool closed;        ///< every edge of the reference has two faces, that agree on what is outside
  /// Three corners, in nodes, of each triangle of the reference, with the outside on their left-hand turn.
  std::vector<glm::vec3> corners;

  /// For a valid reference in its frame, whose triangles run the other way round if it is `mirrored`; `tolerance` in
  /// the frame. Of a closed reference the inside is what it encloses, whichever way its faces run. O(nodes in the
  /// band), about 0.5 s for 270,000 triangles at 1 % of their size.
  DisplayGrid(const TriangleMesh& reference, bool mirrored, double tolerance, const Options& options);

  /// In spacings, at a place given in nodes: interpolated between the eight nodes around it, as
  /// shaders/signed_distance.glsl does.
  float interpolated(const glm::dvec3& node) const;
  /// From the nearest of the triangles that those eight nodes are nearest to, as shaders/nearest_distance.glsl: never
  /// less than the true distance, and right unless another triangle is nearer; the band where there is none.
  float nearest(const glm::dvec3& node) const;
};

/// Shares of the area of a mesh, its vertices given in nodes, with distances in the intervals that `edges` (ascending,
/// in spacings) part: edges.size() + 1 numbers, together 1, or all 0 for a mesh without area. By nearest() or
/// interpolated() at one sample a triangle and some 65,536 more. O(m), 10 ms for 270,000 triangles.
std::vector<double> area_shares(const DisplayGrid& display, bool nearest, std::span<const glm::dvec3> nodes,
                                std::span<const glm::uvec3> triangles, std::span<const double> edges,
                                unsigned threads = 0);

}  // namespace tolvol
