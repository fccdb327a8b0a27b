// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/earlier_fillings.h"

#include <numeric>

#include "base/call.h"

namespace tolvol {

EarlierFillings::EarlierFillings(const FillingRules& rules, std::span<const Hole> holes, Team& team) : rules_(rules) {
  std::vector<Box> boxes;
  for (const Hole& hole : holes) {
    first_.push_back(static_cast<std::uint32_t>(faces_.size()));
    for (const glm::uvec3& face : hole.faces) {
      faces_.push_back(rules_.corners_of(hole, face));
      number_.push_back(hole.number);
      boxes.push_back(box_of(faces_.back()));
    }
  }
  first_.push_back(static_cast<std::uint32_t>(faces_.size()));
  std::vector<std::uint32_t> names(faces_.size());
  std::iota(names.begin(), names.end(), 0u);
  tree_ = FaceTree(names, boxes, team);
}

bool EarlierFillings::allow(const Hole& hole) const {
  bool apart = true;
  hole.for_each_inner_edge([&](std::uint32_t a, std::uint32_t b) { apart &= !has_edge(rules_.edge_of(hole, a, b)); });
  for (std::uint32_t f = first_[hole.number]; f < first_[hole.number + 1] && apart; ++f) {
    poll();
    for_each_near(hole, box_of(faces_[f]),
                  [&](const Corners& other) { return apart = !faces_cross(faces_[f], other); });
  }
  return apart;
}

void EarlierFillings::replace(const Hole& hole) {
  const std::uint32_t first = first_[hole.number];
  for (std::uint32_t f = first; f < first_[hole.number + 1]; ++f) {
    if (!hole.faces.empty()) faces_[f] = rules_.corners_of(hole, hole.faces[f - first]);
    tree_.change(f, hole.faces.empty() ? Box() : box_of(faces_[f]));
  }
}

void EarlierFillings::keep(const Hole& hole) {
  hole.for_each_inner_edge([&](std::uint32_t a, std::uint32_t b) { edges_.insert(rules_.edge_of(hole, a, b)); });
}

}  // namespace tolvol
