// SPDX-License-Identifier: GPL-3.0-or-later
/// The tolerance volume as a bit per cell [S. Zelinka, M. Garland, Permission Grids: Practical, Error-Bounded
/// Simplification, ACM Transactions on Graphics 21(2), 2002].
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace tolvol::baselines {

class PermissionGrid {
 public:
  /// The cells have the edge tolerance / precision, and fill the box of a valid mesh (geometry/triangle_mesh.h) that is
  /// enlarged by the tolerance. Everything is in the mesh's units. A cell is permitted when it lies completely inside
  /// the volume: when its centre is within the tolerance less half of the cell's diagonal. Throws InvalidInput unless
  /// tolerance and precision are positive and some cell can be permitted (precision > sqrt(3) / 2), ResourceLimit above
  /// kBudget. O(cells), in slabs: a thread holds kSlab, or a layer of cells, beside the bits.
  PermissionGrid(const TriangleMesh& reference, double tolerance, double precision, unsigned threads = 0);

  /// A point outside the grid gets a cell outside it.
  glm::ivec3 cell_of(const glm::dvec3& p) const { return glm::ivec3(glm::floor((p - origin_) / spacing_)); }
  bool permits(const glm::ivec3& cell) const {
    return glm::all(glm::greaterThanEqual(cell, glm::ivec3(0))) && glm::all(glm::lessThan(cell, cells_)) &&
           (bits_[byte_of(cell)] >> (cell.x % 8) & 1);
  }

  /// Returns the lowest corner of cell (0, 0, 0).
  const glm::dvec3& origin() const { return origin_; }
  double spacing() const { return spacing_; }
  const glm::ivec3& cells() const { return cells_; }
  /// Returns how many bytes the grid holds.
  std::size_t memory() const { return bits_.size(); }

  /// The bits of a grid may take so many bytes.
  static constexpr std::size_t kBudget = std::size_t{2} << 30;
  /// The distances that a thread holds at a time take so many bytes, or those of one layer of cells if these are more.
  static constexpr std::size_t kSlab = std::size_t{16} << 20;

 private:
  std::size_t byte_of(const glm::ivec3& c) const {
    return (static_cast<std::size_t>(c.z) * cells_.y + c.y) * row_ + c.x / 8;
  }

  glm::dvec3 origin_;
  double spacing_;
  glm::ivec3 cells_{0};
  int row_ = 0;  ///< A row of cells along x takes so many bytes.
  std::vector<std::uint8_t> bits_;
};

}  // namespace tolvol::baselines
