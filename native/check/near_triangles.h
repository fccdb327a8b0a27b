// SPDX-License-Identifier: GPL-3.0-or-later
/// Finds the nearest triangles to the parts of one piece. If boxes of large triangles overlap, every search of the
/// hierarchy looks at a share of all triangles. A triangle near a part is also near the part that it was cut from, so
/// that the search for it need only look at the triangles that were found there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "check/facing.h"
#include "check/part.h"
#include "check/witness.h"
#include "geometry/hierarchy.h"

namespace tolvol {

/// Each thread has one of its own, and uses it for one piece after another, so that its memory is reused.
class NearTriangles {
 public:
  /// Begins with a new piece, whose whole has of = 0. Keeps references. `hierarchy` holds the triangles, which must be
  /// as large as in a frame. `radius` is the largest radius that nearest() will be asked for. If `facing` is not null,
  /// there are only the triangles that it admits. If `steps` is not null, nearest() adds its steps
  /// to it: one for a node that it visits, and one for four triangles of a list.
  void begin(const Witnesses& triangles, const Hierarchy& hierarchy, double radius, const Facing* facing = nullptr,
             std::size_t* steps = nullptr);

  /// Returns exactly hierarchy.nearest(centre, radius, hint).triangle, or that of facing->nearest(), for the centre of
  /// a part. Writes part.of, which names the list of triangles near the part, and which its parts inherit. `enough` is
  /// as for facing->nearest(); it matters only as long as there is no list.
  std::uint32_t nearest(Part& part, const glm::dvec3& centre, double radius, std::uint32_t hint,
                        const FacingRule::Enough& enough = {});

  /// The number of searches of the hierarchy since begin().
  std::size_t searches() const { return searches_; }

 private:
  struct List {
    std::size_t begin, end;  // are indices into pool_
  };

  double reach(const Part& part, const glm::dvec3& centre) const;
  bool gather(Part& part, const glm::dvec3& centre);
  void narrow(Part& part, const glm::dvec3& centre);
  void look_at(std::uint32_t triangle, const glm::dvec3& centre, double reach2);
  std::uint32_t search(const glm::dvec3& centre, double radius, std::uint32_t hint, const FacingRule::Enough& enough);

  std::optional<Witnesses> triangles_;
  const Hierarchy* hierarchy_ = nullptr;
  const Facing* facing_ = nullptr;
  std::size_t* steps_ = nullptr;
  double radius_ = 0;
  std::size_t searches_ = 0, nodes_ = 0;  // nodes_ counts the nodes that the searches have visited
  double too_far_ = 0;                    // is the least reach() for which a list became too long
  std::vector<std::uint32_t> pool_;       // holds the lists, one after the other
  std::vector<List> lists_;               // is indexed by Part::of; the first list stands for all triangles
  double best2_ = 0, second2_ = 0;        // are the squared distances of the two nearest triangles that were looked at
  std::uint32_t best_ = Hierarchy::kNone;
};

}  // namespace tolvol
