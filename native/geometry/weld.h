// SPDX-License-Identifier: GPL-3.0-or-later
/// Finds vertices at one position.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"

namespace tolvol {

/// Returns for each vertex the first vertex with exactly the same coordinates, which may be itself. Coordinates are
/// equal if they are equal numbers, so that -0 is 0. There are fewer than 2^32 - 1 vertices. O(n) expected.
std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::dvec3> vertices, Team& team);
std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::vec3> vertices, Team& team);
/// The same on the caller's thread alone.
std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::dvec3> vertices);

}  // namespace tolvol
