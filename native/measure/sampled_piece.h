// SPDX-License-Identifier: GPL-3.0-or-later
/// The pieces of a surface that stand for it in its statistics, each with one point that is as good as random.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "measure/distance_bounds.h"

namespace tolvol {

/// What the weight of a piece in the averages is. Its value is the number of corners of the pieces.
enum Measure { kNumber = 1, kLength = 2, kArea = 3 };

/// Returns the weight of a piece.
double measure_of(const Simplex& s);

/// Returns the triangle itself, its longest edge or its first corner.
Simplex simplex_of(const std::array<glm::dvec3, 3>& p, Measure measure);

/// Calls visit(piece) for k parts of a segment or k x k equal parts of a triangle.
template <class Visit>
void cut(const Simplex& s, int k, Visit&& visit) {
  const auto& p = s.corner;
  if (s.corners == kNumber) visit(s);
  if (s.corners == kLength) {
    const auto at = [&](int i) { return glm::mix(p[0], p[1], double(i) / k); };
    for (int i = 0; i < k; ++i) visit(Simplex{{at(i), at(i + 1), at(i + 1)}, kLength});
  }
  if (s.corners == kArea) {
    const auto at = [&](int i, int j) { return p[0] + double(i) / k * (p[1] - p[0]) + double(j) / k * (p[2] - p[0]); };
    for (int i = 0; i < k; ++i) {
      for (int j = 0; i + j < k; ++j) {
        visit(Simplex{{at(i, j), at(i + 1, j), at(i, j + 1)}, kArea});
        if (i + j + 1 < k) visit(Simplex{{at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)}, kArea});
      }
    }
  }
}

/// Returns the weights of the corners at the n-th point, which are evenly spread over the piece.
glm::dvec3 weights_in(const Simplex& s, std::uint64_t n);

struct SampledPiece {
  Simplex simplex;
  double weight = 0;
  DistanceBounds bounds;
  double distance = 0;  // is that of its point
  double average = 0;   // estimates the mean over the piece: the distance of its point, corrected where that is sharper
  bool inside = false;  // tells whether its point is inside the other surface, if that is closed

  double signed_distance() const { return inside ? -distance : distance; }
  /// Returns the distance of the point with these weights less the value of a linear function there, plus its mean. The
  /// function is the middle between the bounds, so that the difference is small, and as good as random.
  double corrected(const glm::dvec3& weights) const;
  double signed_average() const { return inside ? -average : average; }
  /// Returns the width of an interval that holds `average` whatever the point is.
  double width() const { return std::min(bounds.room(simplex.corners), bounds.value.upper - bounds.value.lower); }
  double gap() const { return weight * (bounds.mean.upper - bounds.mean.lower); }
};

}  // namespace tolvol
