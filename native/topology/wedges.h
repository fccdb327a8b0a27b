// SPDX-License-Identifier: GPL-3.0-or-later
/// Finds attribute seams. Corners of the triangles around a vertex that share their attributes are a wedge, and
/// triangles that are connected without crossing a seam are an island [H. Hoppe, "New quadric metric for simplifying
/// meshes with appearance attributes", 1999, §3].
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace tolvol {

/// Returns a label for each corner. Two corners have the same label exactly if they are at the same vertex and all
/// their `width` values are equal. `values` holds `width` values for each corner. O(m) expected.
std::vector<std::uint32_t> wedge_labels(std::span<const glm::uvec3> triangles, std::span<const float> values,
                                        std::size_t width);

/// Returns a label for each triangle. Labels are equal if a path joins the triangles over edges with equal wedges at
/// both ends.
std::vector<std::uint32_t> island_labels(std::span<const glm::uvec3> triangles, std::span<const glm::uvec3> wedges);

}  // namespace tolvol
