// SPDX-License-Identifier: GPL-3.0-or-later
/// The fillings of holes that were filled as if each were alone, to keep each apart from those of lower number.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <unordered_set>
#include <vector>

#include "base/parallel.h"
#include "repair/filling_rules.h"
#include "topology/face_tree.h"
#include "topology/faces_cross.h"

namespace tolvol {

class EarlierFillings {
 public:
  /// Takes the faces of all holes, which are in the order of their numbers. Keeps a reference to the rules.
  /// O(n log n).
  EarlierFillings(const FillingRules& rules, std::span<const Hole> holes, Team& team);

  /// Whether the faces of a hole cross none of a lower one, and have no inner edge in common with one that was kept.
  bool allow(const Hole& hole) const;
  /// Takes the faces of a hole that was filled anew in place of those that it had. There are as many, or none.
  void replace(const Hole& hole);
  /// Keeps the inner edges of a hole, which higher ones must not have.
  void keep(const Hole& hole);

  /// Whether an edge (FillingRules::edge_of()) is one of those that were kept.
  bool has_edge(std::uint64_t edge) const { return edges_.contains(edge); }
  /// Calls visit(corners) for the faces of lower holes whose boxes meet `box`. A visit that returns false is the last
  /// one.
  template <class Visit>
  void for_each_near(const Hole& hole, const Box& box, Visit&& visit) const {
    tree_.for_each_meeting(box,
                           [&](std::uint32_t face) { return number_[face] >= hole.number || visit(faces_[face]); });
  }

 private:
  const FillingRules& rules_;
  std::vector<Corners> faces_;
  std::vector<std::uint32_t> number_;  ///< for each face: that of its hole
  std::vector<std::uint32_t> first_;   ///< for each hole, and one more: its first face
  FaceTree tree_;
  std::unordered_set<std::uint64_t> edges_;
};

}  // namespace tolvol
