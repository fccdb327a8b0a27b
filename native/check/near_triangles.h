// SPDX-License-Identifier: GPL-3.0-or-later
/// The nearest triangles to the parts of one piece. Where boxes of large triangles overlap, every search of the
/// hierarchy looks at a share of all triangles; what is near to a part is near to the part it was cut from, so that it
/// need only be sought among the triangles found there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "check/part.h"
#include "check/witness.h"
#include "geometry/hierarchy.h"

namespace tolvol {

/// For one thread. Reused from piece to piece, so that its memory is.
class NearTriangles {
 public:
  /// Begins with a piece, the whole of which has of = 0. Keeps references. `hierarchy`: of the triangles, which have
  /// the size of a frame. `radius`: the largest that will be asked for.
  void begin(const std::vector<WitnessTriangle>& triangles, const Hierarchy& hierarchy, double radius);

  /// hierarchy.nearest(centre, radius, hint).triangle, exactly, for the centre of a part. Writes part.of, which its
  /// parts inherit: the list of what is near to all of it.
  std::uint32_t nearest(Part& part, const glm::dvec3& centre, double radius, std::uint32_t hint);

  /// How often the hierarchy was asked since begin().
  std::size_t searches() const { return searches_; }

 private:
  struct List {
    std::size_t begin, end;  // in pool_
  };

  double reach(const Part& part, const glm::dvec3& centre) const;
  bool gather(Part& part, const glm::dvec3& centre);
  void narrow(Part& part, const glm::dvec3& centre);
  void look_at(std::uint32_t triangle, const glm::dvec3& centre, double reach2);
  std::uint32_t search(const glm::dvec3& centre, double radius, std::uint32_t hint);

  const std::vector<WitnessTriangle>* triangles_ = nullptr;
  const Hierarchy* hierarchy_ = nullptr;
  double radius_ = 0;
  std::size_t searches_ = 0;
  double too_far_ = 0;               // the least reach() for which a list became too long
  std::vector<std::uint32_t> pool_;  // the lists, one after the other
  std::vector<List> lists_;          // by Part::of; the first stands for all triangles
  double best2_ = 0, second2_ = 0;   // squared distances of the two nearest that were looked at
  std::uint32_t best_ = Hierarchy::kNone;
};

}  // namespace tolvol
