// SPDX-License-Identifier: GPL-3.0-or-later
/// Signed distances to draw pictures by [Botsch04, §3]: interpolated, and therefore never for a check.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/progress.h"
#include "field/distance_grid.h"

namespace tolvol {

struct DisplayGrid {
  struct Options {
    double precision = 4;  ///< nodes per tolerance, unless that is more nodes than:
    int longest = 2048;    ///< along an axis: what every GL 4 takes in a 3D texture
    std::size_t nodes = kGridBudget / (sizeof(float) + sizeof(std::uint32_t));  ///< in all
    unsigned threads = 0;
    Progress* progress = nullptr;
  };
  DistanceGrid grid;  ///< distances in units of its spacing, negative inside
  bool closed;        ///< every edge of the reference has two faces, that agree on what is outside

  /// For a valid reference in its frame, whose triangles run the other way round if it is `mirrored`; `tolerance` in
  /// the frame. Of a closed reference the inside is what it encloses, whichever way its faces run. O(nodes in the
  /// band), about 0.5 s for 270,000 triangles at 1 % of their size.
  DisplayGrid(const TriangleMesh& reference, bool mirrored, double tolerance, const Options& options);
};

}  // namespace tolvol
