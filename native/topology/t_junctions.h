// SPDX-License-Identifier: GPL-3.0-or-later
/// T-junctions of a mesh: open edges on which vertices of other open edges lie. The faces there meet, but share no
/// edge.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"

namespace tolvol {

/// The vertices that hold the T-junctions together, in rising order: those that lie on an edge between its ends, the
/// ends of these edges, and what is at the same places. `edges` are the open edges, as pairs of vertices. A vertex lies
/// on an edge if it is as near as the rounding of coordinates may have put it: within 4 * `unit` * the largest
/// coordinate of the three, where `unit` is half the distance from 1 to the next number. O(n log n) for n edges, about
/// 1 us each.
std::vector<std::uint32_t> t_junctions(std::span<const glm::dvec3> vertices, std::span<const glm::uvec2> edges,
                                       double unit, Team& team);

}  // namespace tolvol
