// SPDX-License-Identifier: GPL-3.0-or-later
/// Parts of a triangle for which witnesses are sought one by one, and two ways to make smaller ones.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "check/witness.h"

namespace tolvol {

struct Part {
  glm::dvec3 corners[3];
  std::uint32_t cuts = 0;  ///< made since it was whole; past kMostCuts rounding would no longer be within the bounds
  std::uint32_t of = 0;    ///< what it is a part of, for whoever wants to know
};

/// A cut puts a corner up to 3u |x| from where it should be, u = 2^-53, and a part of a part inherits that: every point
/// of the whole is within so many times 3u |x| of the parts. |x| <= sqrt(3) R + d: 32 cuts are below 32 * 5.2 u (R +
/// d), for which witness_error() has room.
inline constexpr std::uint32_t kMostCuts = 32;

double longest_squared(const Part& part);

/// Appends the halves of a needle, or four quarters. A segment is (a, b, b), and so are its parts.
void split(const Part& part, std::vector<Part>& out);

/// Cuts a part where an edge of a triangle runs below it, and appends both sides: of the three edges the one that
/// leaves most on both. False, and nothing done, where none leaves a strip of width `least` on both.
bool cut(const Part& part, const WitnessTriangle& triangle, double least, std::vector<Part>& out);

}  // namespace tolvol
