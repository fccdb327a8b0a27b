// SPDX-License-Identifier: GPL-3.0-or-later
/// The faces that a change replaces, as witnesses of those that take their place: what is within w of a face that is
/// within e of the reference is within e + w of it.
///
/// There are few of them, where a large face lies near thousands of triangles of the reference: on what is flat, or
/// nearly, this proves in no time what looking at all of these proves again and again.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "check/part.h"
#include "check/witness.h"

namespace tolvol {

class ReplacedFaces {
 public:
  void clear() { faces_.clear(), farthest_ = 0; }
  /// `distance`: an upper bound on the distance of its points to the reference.
  void add(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double distance);
  bool empty() const { return faces_.empty(); }

  /// An upper bound, at most `limit`, on the distance of any point of the triangle to the reference; infinity where
  /// none was found. About 20 ns a face where it is not flat.
  double bound(const glm::dvec3 (&corners)[3], double limit);

 private:
  std::vector<WitnessTriangle> faces_;
  double farthest_ = 0;  ///< of their distances
  std::vector<Part> parts_;
};

}  // namespace tolvol
