// SPDX-License-Identifier: GPL-3.0-or-later
/// Regions of a mesh that can be worked on at once: compact groups of vertices, of about equal size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "decimation/bounded_mesh.h"

namespace tolvol {

struct Regions {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  /// For each vertex, the region that it and all its neighbours belong to; kNone for a joined vertex, and for one at
  /// the rim of a region. As long as only edges within regions collapse, a collapse in one region changes nothing that
  /// a collapse in another region changes or reads.
  std::vector<std::uint32_t> of_vertex;
  std::uint32_t count = 0;

  /// The region that both ends of an edge belong to; kNone where there is no such region.
  std::uint32_t of_edge(const BoundedMesh& mesh, std::uint32_t edge) const;
};

/// Cuts along the longest axis at the median, over and over, until no region has more than `most` vertices. The first
/// cut leaves the share `first` of the vertices on one side instead, so that another share puts the rims elsewhere.
/// O(n log n). The regions are the same on every machine, for any number of threads.
Regions regions(const BoundedMesh& mesh, std::size_t most, double first, Team& team);

}  // namespace tolvol
