// SPDX-License-Identifier: GPL-3.0-or-later
/// Sheets of a mesh that lie exactly on each other, such as the two sides of a leaf card.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace tolvol {

/// Per triangle: a label that is equal for the triangles of sheets that lie on each other, or kNoSheet. A triangle is
/// part of a double sheet when another has the same three positions; such triangles are of one group when they lie on
/// each other or share an edge. O(n + m) expected.
inline constexpr std::uint32_t kNoSheet = 0xFFFFFFFFu;
std::vector<std::uint32_t> double_sheets(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles);

}  // namespace tolvol
