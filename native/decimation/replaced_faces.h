// SPDX-License-Identifier: GPL-3.0-or-later
/// The faces that a change replaces, as witnesses of the faces that take their place: a point within w of a face that
/// is within e of the reference is within e + w of the reference.
///
/// A change replaces few faces, but a large face lies near thousands of triangles of the reference. Where the faces are
/// nearly flat, the few prove at once what the thousands would prove anew for every change.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "check/part.h"
#include "check/witness.h"

namespace tolvol {

class ReplacedFaces {
 public:
  void clear() { faces_.clear(), farthest_ = 0; }
  /// `distance` is an upper bound on the distance of the face's points to the reference.
  void add(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double distance);
  bool empty() const { return faces_.empty(); }

  /// An upper bound, at most `limit`, on the distance of any point of the triangle to the reference; infinity where the
  /// search finds none. It takes about 20 ns for each face where the faces are not flat.
  double bound(const glm::dvec3 (&corners)[3], double limit);

 private:
  std::vector<WitnessTriangle> faces_;
  double farthest_ = 0;  ///< The largest of the faces' distances.
  std::vector<Part> parts_;
};

}  // namespace tolvol
