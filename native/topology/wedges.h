// SPDX-License-Identifier: GPL-3.0-or-later
/// Attribute seams: which corners of the triangles around a vertex share their attributes (a wedge), and which
/// triangles hang together without crossing a seam (an island). H. Hoppe, "New quadric metric for simplifying meshes
/// with appearance attributes", 1999, §3.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace tolvol {

/// A label for each corner; two corners have the same label exactly when they are at the same vertex and all their
/// `width` values are equal. `values` holds width values a corner. O(m) expected.
std::vector<std::uint32_t> wedge_labels(std::span<const glm::uvec3> triangles, std::span<const float> values,
                                        std::size_t width);

/// A label for each triangle; equal where a path of triangles joins them over edges with the same wedges at both ends.
std::vector<std::uint32_t> island_labels(std::span<const glm::uvec3> triangles, std::span<const glm::uvec3> wedges);

}  // namespace tolvol
