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
  std::uint32_t cuts = 0;  ///< counts the cuts that made it; after more than kMostCuts the bounds would not hold
  std::uint32_t of = 0;    ///< names what it is a part of; split() and cut() hand it on
};

/// A cut puts a corner up to 3u |x| from its exact place, u = 2^-53, and a part of a part inherits the error, so that
/// after n cuts every point of the whole is within 3 n u |x| of the parts. Since |x| <= sqrt(3) R + d, 64 cuts err by
/// less than 64 * 5.2 u (R + d), for which witness_error() has room. split() may take two cuts to halve the longest
/// edge, so that 64 cuts by split() alone reach parts of 2^-32 of the length.
inline constexpr std::uint32_t kMostCuts = 64;

double longest_squared(const Part& part);

/// Appends the halves of a needle, or four quarters. A segment is (a, b, b), and its parts have the same form.
void split(const Part& part, std::vector<Part>& out);

/// Cuts a part where an edge of a triangle runs below it, and appends both sides. Of the three edges it takes the one
/// whose narrower side is the widest. Returns false and does nothing if both sides are not wider than `least`.
bool cut(const Part& part, const WitnessTriangle& triangle, double least, std::vector<Part>& out);

}  // namespace tolvol
