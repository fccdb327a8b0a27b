// SPDX-License-Identifier: GPL-3.0-or-later
/// Distances from the reference at the nodes of a regular grid, with the closest triangle of each node [Botsch04, §2].
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// The most bytes for distances and ids together, unless someone asks for another number. It is a constant, so that
/// results do not depend on the machine.
inline constexpr std::size_t kGridBudget = std::size_t{256} << 20;

/// A grid has fewer than 2^31 nodes, because node numbers of 32 bits have to do (field/fast_marching.cpp).
inline constexpr std::size_t kLargestGrid = std::size_t{16} << 30;
/// A grid that does not fit is made coarser by this factor. With 1/2, up to seven eighths of the memory would stay
/// unused, and at half the precision the decimation of a mesh whose edges are far shorter than the tolerance takes half
/// as long again.
inline constexpr double kCoarser = 0.8;

struct DistanceGrid {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  glm::dvec3 origin{0};    ///< is the position of node (0, 0, 0)
  double spacing = 0;      ///< is h, the same along each axis
  glm::ivec3 nodes{0};     ///< are the numbers of nodes along x, y, z
  int pitch = 0;           ///< is the number of nodes from one row to the next, padded(nodes.x)
  double band = 0;         ///< is the distance up to which nodes hold more than the band and kNone
  bool is_signed = false;  ///< tells whether distances are negative inside the reference; otherwise none is negative
  std::vector<float> distance;
  std::vector<std::uint32_t> triangle;

  std::size_t index(int x, int y, int z) const { return (static_cast<std::size_t>(z) * nodes.y + y) * pitch + x; }
  /// Rows are padded so that a kernel may touch whole vectors.
  static constexpr int kLanes = 8;
  static constexpr int padded(int row) { return (row + kLanes - 1) / kLanes * kLanes; }
  std::size_t memory() const { return distance.size() * (sizeof(float) + sizeof(std::uint32_t)); }

  /// Tells whether p is nearer to a node than to the place of a next node outside the grid. It is false for NaN.
  bool contains(const glm::dvec3& p) const {
    const glm::dvec3 c = (p - origin) * (1 / spacing) + 0.5;
    return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < nodes.x && c.y < nodes.y && c.z < nodes.z;
  }
  /// Returns the triangle of the node nearest to p, or kNone outside the grid. After scatter() it is a closest triangle
  /// of that node, or kNone if there is none within the band. O(1).
  std::uint32_t triangle_near(const glm::dvec3& p) const {
    if (!contains(p)) return kNone;
    const glm::dvec3 c = (p - origin) * (1 / spacing) + 0.5;
    return triangle[index(static_cast<int>(c.x), static_cast<int>(c.y), static_cast<int>(c.z))];
  }
};

/// Returns the finest of `finest`, 0.8 `finest`, 0.64 `finest`, ... whose grid takes at most `most` bytes, or 4,096 if
/// that is more.
double precision_that_fits(const Box& box, double tolerance, double finest, std::size_t most = kGridBudget);

/// Lays out the grid of a reference: its box enlarged by the band, with the spacing tolerance / precision. If
/// `precision` is empty it is the finest of 1, 0.8, 0.64, ... that fits `most` bytes. Allocates nothing. Throws
/// ResourceLimit, naming a precision that fits, for a precision whose grid takes more than kGridBudget.
DistanceGrid layout_grid(const Box& box, double tolerance, std::optional<double> precision,
                         std::size_t most = kGridBudget);

}  // namespace tolvol
