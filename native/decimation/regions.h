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
  /// Per vertex: the region that it and all its neighbours belong to; kNone at the rim of one, and for joined ones.
  /// As long as only edges of a region collapse, nothing that a collapse changes or looks at is changed by another's.
  std::vector<std::uint32_t> of_vertex;
  std::uint32_t count = 0;

  /// The region of an edge: that of its two ends.
  std::uint32_t of_edge(const BoundedMesh& mesh, std::uint32_t edge) const;
};

/// Cuts along the longest axis at a median, over and over, until no region has more than `most` vertices. The first cut
/// is at `first` of the vertices instead, by which the rims come to lie elsewhere. O(n log n); the same everywhere, on
/// any number of threads.
Regions regions(const BoundedMesh& mesh, std::size_t most, double first, Team& team);

}  // namespace tolvol
