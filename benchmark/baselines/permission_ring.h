// SPDX-License-Identifier: GPL-3.0-or-later
/// A permission grid as the judge of a decimation's collapses [S. Zelinka, M. Garland, Permission Grids: Practical,
/// Error-Bounded Simplification, 2002]: every cell that a new face overlaps must be permitted.
#pragma once

#include "baselines/permission_grid.h"
#include "check/ring_check.h"

namespace tolvol::baselines {

/// Whether the triangle lies in permitted cells alone: every cell of the grid that it overlaps or touches is looked at,
/// by separating axes, and what is outside the grid is not permitted. O(cells overlapped + rows of its projection).
bool permits(const PermissionGrid& grid, const glm::dvec3 (&corners)[3]);

class PermissionRing final : public RingCheck {
 public:
  /// Keeps a reference to `grid`, which is of the reference in its frame.
  explicit PermissionRing(const PermissionGrid& grid) : grid_(&grid) {}

  void begin(const TriangleMesh&, const StoredSpace&) override {}
  std::unique_ptr<Trial> trial() override;
  std::string method() const override { return "permission_grid"; }

 private:
  class Asking;

  const PermissionGrid* grid_;
};

}  // namespace tolvol::baselines
