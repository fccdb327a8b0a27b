// SPDX-License-Identifier: GPL-3.0-or-later
/// Sorts triangles along a Morton curve, on which neighbours in space are mostly near each other.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "base/default_init.h"
#include "base/parallel.h"

namespace tolvol {

/// A triangle, or a slice of one (geometry/hub_slices.h), to be sorted.
struct MortonKey {
  std::uint64_t code;
  std::uint32_t triangle, slice;
};

/// Returns the Morton code of a point, of 63 bits. Coordinates below -1 or above 1 count as -1 and 1.
std::uint64_t morton_code(const glm::dvec3& p);

/// Sorts by code. Keys with one code stay in their order, on any number of threads. O(n).
void sort_by_code(Unfilled<MortonKey>& keys, Team& team);

}  // namespace tolvol
