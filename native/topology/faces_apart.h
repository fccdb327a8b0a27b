// SPDX-License-Identifier: GPL-3.0-or-later
/// Quick proofs that triangles do not cross, which faces_cross() tries first, and that they are apart.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "geometry/triangle_mesh.h"
#include "topology/faces_cross.h"

namespace tolvol {

/// A lower bound on the distance of two triangles, 0 where none is found. Rounding is inside the bound. It is the
/// largest gap along a few directions, so that it is seldom far below the distance, or the first that is `enough`.
/// O(1), 10 to 50 ns.
double gap(const Corners& a, const Corners& b, double enough);

/// Whether it is certain, in spite of rounding, that the triangles do not cross. False where that is not certain. O(1),
/// 5 to 50 ns.
bool surely_uncrossed(const Corners& a, const Corners& b);

/// The box of the corners other than `hub`; of all corners if none of them is there, or all.
Box rim_of(const Corners& corners, const glm::dvec3& hub);

/// The box of the directions from `hub` to the same corners: the way to a corner over its largest coordinate.
Box directions_of(const Corners& corners, const glm::dvec3& hub);

/// Proofs that one triangle crosses none of many faces around a hub at once. The boxes of slivers side by side overlap,
/// wherever they run aslant; seen from the hub, the slivers lie one beside the other.
class ApartFromFan {
 public:
  /// O(1), about 200 ns.
  ApartFromFan(const Corners& own, const glm::dvec3& hub);

  /// Whether it is certain, in spite of rounding, that the triangle crosses no face whose corners are the hub and
  /// points in the box `rims`, or such points alone. False where that is not certain. What holds of a box holds of each
  /// box in it. `rims` must not be empty. O(1), 5 to 50 ns.
  bool surely(const Box& rims) const;
  /// The same by a box of the directions in which the corners are seen from the hub, instead of a box around them. This
  /// has to be a triangle for which looks_by_directions() holds.
  bool surely_seen(const Box& directions) const { return is_beyond_side(directions); }
  /// Whether the triangle shares the hub and is not so flat that rounding leaves it no sides.
  bool looks_by_directions() const { return shares_hub_ && count_ > 0; }

 private:
  /// All of the triangle but the hub lies where dot(normal, p - hub) is below `most`, which is not positive.
  struct Side {
    glm::dvec3 normal;
    double most;
  };
  void add(const Corners& own, const glm::dvec3& normal);
  /// Whether all of a box, whose coordinates count from the hub, is beyond one of the sides.
  bool is_beyond_side(const Box& from_hub) const;

  glm::dvec3 hub_;
  Box whole_, opposite_;  ///< Around the triangle, and around what of it is opposite the hub: all, if it has no hub.
  bool shares_hub_;
  int count_ = 0;
  std::array<Side, 7> sides_;
};

}  // namespace tolvol
