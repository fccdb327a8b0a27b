// SPDX-License-Identifier: GPL-3.0-or-later
/// The pairs of faces of a mesh that cross each other.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"

namespace tolvol {

struct Crossings {
  std::vector<glm::uvec2> pairs;  ///< of triangles, the lower index first; in order
  bool complete = true;           ///< false: there are more, and the search ended at `most`
};

/// All pairs of triangles that cross (topology/faces_cross.h), or `most` of them where there are more.
/// Decided exactly for the coordinates given, which must be finite. The same on any number of threads. Throws
/// Cancelled. About 1.3 us a triangle on one thread where few boxes overlap.
Crossings crossings(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, std::size_t most,
                    Team& team, Progress* progress);

}  // namespace tolvol
