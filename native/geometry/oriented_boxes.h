// SPDX-License-Identifier: GPL-3.0-or-later
/// Boxes that are turned along the triangles in them, for triangles so narrow that boxes along the axes are mostly
/// empty.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <span>

namespace tolvol {

/// The boxes of the children of one node of a Hierarchy. Coordinates are local (hierarchy.cpp).
class OrientedBoxes {
 public:
  static constexpr int kWidth = 8;

  /// All boxes are empty at first, which means infinitely far from everything.
  OrientedBoxes();

  /// Makes box i hold all that is within `room` of the triangles, or of the faces of five corners. Its first axis is
  /// the direction of their longest edge. `centre` is subtracted from the corners first. Returns half the area of the
  /// box. O(faces).
  template <std::size_t kCorners>
  double fit(int i, std::span<const std::array<glm::dvec3, kCorners>> faces, const glm::dvec3& centre, double room);

  /// Computes the squared distance of p from each box. It never exceeds the squared distance of p from the triangles in
  /// the box, except by the rounding of the square.
  template <class Real>
  void distances(const glm::dvec3& p, Real (&squared)[kWidth]) const;

 private:
  float axis_[3][3][kWidth];  // coordinate j of axis k of box i is axis_[k][j][i]
  float lower_[3][kWidth], upper_[3][kWidth];
};

}  // namespace tolvol
