// SPDX-License-Identifier: GPL-3.0-or-later
/// The faces that a change replaces, as witnesses of the faces that take their place: a point within w of a face that
/// is within e of the reference is within e + w of the reference, and angles to the witnesses there add up alike.
///
/// A change replaces few faces, but a large face lies near thousands of triangles of the reference. Where the faces are
/// nearly flat, the few prove at once what the thousands would prove anew for every change.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "check/facing.h"
#include "check/part.h"
#include "check/witness.h"
#include "decimation/face_bound.h"

namespace tolvol {

class ReplacedFaces {
 public:
  void clear() { faces_.clear(), normals_.clear(), angles_.clear(), outlines_.clear(), farthest_ = 0, looked_at_ = 0; }
  /// `bound` is what is known of the face's points. `normal` is that of the face, if it keeps the rule of facing.
  void add(const glm::dvec3 (&corners)[3], const FaceBound& bound, const std::optional<glm::dvec3>& normal);
  bool empty() const { return faces_.empty(); }

  /// What is then known of a triangle: a distance of at most `limit`, or none where the search finds no proof. If
  /// `facing` is not null, the bound keeps it. It takes about 20 ns for each face where the faces are not flat, and as
  /// much for each face near each part that it cuts the triangle into.
  FaceBound bound(const glm::dvec3 (&corners)[3], double limit, const Facing* facing);

  /// The number of faces that were compared with a part since clear(), once for each part.
  std::size_t looked_at() const { return looked_at_; }

 private:
  /// Three directions across the edges of a face, and the least of each that a corner of the face has, from its first
  /// corner.
  struct Outline {
    glm::dvec3 inwards[3];
    double length[3], least[3];
  };
  /// Faces in `near_`.
  struct List {
    std::size_t begin, end;
  };

  void keep_near(Part& part, double within);

  std::vector<WitnessTriangle> faces_;
  std::vector<Outline> outlines_;                   ///< Of the faces; empty until they are needed.
  std::vector<std::optional<glm::dvec3>> normals_;  ///< Of the faces that keep the rule of facing.
  std::vector<double> angles_;                      ///< For each face: the largest angle between it and its witnesses.
  std::vector<double> turned_;  ///< For each face: the largest angle between the triangle and the face's witnesses.
  double farthest_ = 0;         ///< The largest of the faces' distances.
  std::vector<Part> parts_;
  std::vector<std::uint32_t> near_;  ///< The lists, one after the other.
  std::vector<List> lists_;          ///< Indexed by Part::of: the faces that may be near the part, ascending.
  std::size_t looked_at_ = 0;
};

}  // namespace tolvol
