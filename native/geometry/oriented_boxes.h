// SPDX-License-Identifier: GPL-3.0-or-later
/// Boxes turned along the triangles in them, for triangles so narrow that boxes along the axes are mostly empty.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <span>

namespace tolvol {

/// The boxes of the children of one node of a Hierarchy. Coordinates are local, see hierarchy.cpp.
class OrientedBoxes {
 public:
  static constexpr int kWidth = 8;
  using Corners = std::array<glm::dvec3, 3>;

  /// All of them empty: infinitely far from everything.
  OrientedBoxes();

  /// Makes box i hold the triangles: its first axis is the direction of their longest edge. `centre` is subtracted from
  /// the corners first. Returns half the area of the box. O(triangles).
  double fit(int i, std::span<const Corners> triangles, const glm::dvec3& centre);

  /// The squared distance of p from each box. None exceeds the squared distance of p from what the box holds, except by
  /// the rounding of the square.
  template <class Real>
  void distances(const glm::dvec3& p, Real (&squared)[kWidth]) const;

 private:
  float axis_[3][3][kWidth];  // coordinate j of axis k of box i is axis_[k][j][i]
  float lower_[3][kWidth], upper_[3][kWidth];
};

}  // namespace tolvol
