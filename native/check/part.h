// SPDX-License-Identifier: GPL-3.0-or-later
/// Parts of a triangle for which witnesses are sought one by one, and two ways to make smaller ones.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace tolvol {

struct Part {
  glm::dvec3 corners[3];
  std::uint32_t cuts = 0;  ///< made since it was whole; past kMostCuts rounding would no longer be within the bounds
};

/// A cut puts a corner up to 3u |x| from where it should be, u = 2^-53, and a part of a part inherits that: every point
/// of the whole is within so many times 3u |x| of the parts. |x| <= sqrt(3) R + d: 32 cuts are below 32 * 5.2 u (R +
/// d), for which witness_error() has room.
inline constexpr std::uint32_t kMostCuts = 32;

double longest_squared(const Part& part);

/// Appends the halves of a needle, or four quarters.
void split(const Part& part, std::vector<Part>& out);

/// The convex set (a triangle) that covers most of a part, and how to cut off what it covers.
struct Cover {
  double share = 0;      ///< of the part's area, that is sure to be `within`
  double distance[3]{};  ///< of the corners
  double within = 0;     ///< up to where the cut goes

  /// Takes another set when its share is larger. `d2`: squared distances of the corners, and of any other point;
  /// `permitted`: what they may be.
  bool improve(const double (&d2)[4], double permitted);
};

/// Appends what `cover` covers to `inside`, the rest to `rest`. False, and nothing done, where that is too little or
/// leaves a part as long as before: then split().
bool cut(const Part& part, const Cover& cover, std::vector<Part>& inside, std::vector<Part>& rest);

}  // namespace tolvol
