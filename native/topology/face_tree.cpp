// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/face_tree.h"

#include <algorithm>
#include <bit>

namespace tolvol {
namespace {

/// Above this share of a tree's faces, all boxes are fitted anew instead of those above each face.
constexpr std::size_t kMany = 8;

bool same(const Box& a, const Box& b) { return a.lower == b.lower && a.upper == b.upper; }

}  // namespace

FaceTree::FaceTree(std::span<const std::uint32_t> faces, const std::function<Box(std::size_t)>& box, Team& team)
    : place_(faces.size()) {
  if (faces.empty()) return;
  if (faces.back() != faces.size() - 1) faces_.assign(faces.begin(), faces.end());
  struct Entry {
    glm::dvec3 centre;
    std::uint32_t index;  // among the faces
  };
  std::vector<Entry> entries(faces.size());
  for (std::uint32_t i = 0; i < entries.size(); ++i) {
    poll_at(i);
    const Box of_face = box(i);
    entries[i] = {0.5 * of_face.lower + 0.5 * of_face.upper, i};
  }
  leaves_ = std::bit_ceil((entries.size() + kLeaf - 1) / kLeaf);
  slots_of_leaf_ = (entries.size() + leaves_ - 1) / leaves_;
  // Level by level, each range of entries is cut in two at the median along the longest side of its centres' box.
  // `border[i]` is where the range of the level's node i begins.
  std::vector<std::size_t> border{0, entries.size()};
  while (border.size() - 1 < leaves_) {
    std::vector<std::size_t> next(2 * border.size() - 1);
    team.run(border.size() - 1, 1, [&](std::size_t i, std::size_t) {
      const std::span range(entries.begin() + static_cast<std::ptrdiff_t>(border[i]),
                            entries.begin() + static_cast<std::ptrdiff_t>(border[i + 1]));
      next[2 * i] = border[i], next[2 * i + 1] = border[i] + range.size() / 2;
      Box centres;
      for (const Entry& e : range) centres.add(e.centre);
      const glm::dvec3 size = centres.upper - centres.lower;
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      std::nth_element(range.begin(), range.begin() + static_cast<std::ptrdiff_t>(range.size() / 2), range.end(),
                       [axis](const Entry& a, const Entry& b) {
                         return a.centre[axis] < b.centre[axis] ||
                                (a.centre[axis] == b.centre[axis] && a.index < b.index);
                       });
    });
    next.back() = entries.size();
    border.swap(next);
  }
  fill(boxes_, leaves_ * slots_of_leaf_, Box());
  fill(numbers_, boxes_.size(), 0u);
  fill(nodes_, 2 * leaves_ - 1, Box());
  for (std::size_t leaf = 0; leaf < leaves_; ++leaf) {
    poll_at(leaf);
    for (std::size_t i = border[leaf], slot = leaf * slots_of_leaf_; i < border[leaf + 1]; ++i, ++slot) {
      const std::uint32_t index = entries[i].index;
      boxes_[slot] = box(index), numbers_[slot] = faces[index];
      place_[index] = static_cast<std::uint32_t>(slot);
    }
    fit_leaf(leaf);
  }
  for (std::size_t node = leaves_ - 1; node-- > 0;) {
    poll_at(node);
    nodes_[node] = fitted(node);
  }
}

void FaceTree::fit_leaf(std::size_t leaf) {
  Box& box = nodes_[leaves_ - 1 + leaf];
  box = {};
  for (std::size_t i = leaf * slots_of_leaf_; i < (leaf + 1) * slots_of_leaf_; ++i) box.add(boxes_[i]);
}

Box FaceTree::fitted(std::size_t node) const {
  Box box = nodes_[2 * node + 1];
  box.add(nodes_[2 * node + 2]);
  return box;
}

std::size_t FaceTree::slot_of(std::uint32_t face) const {
  if (faces_.empty()) return place_[face];
  return place_[std::lower_bound(faces_.begin(), faces_.end(), face) - faces_.begin()];
}

void FaceTree::change(std::span<const std::uint32_t> faces, std::span<const Box> boxes) {
  if (faces.empty()) return;
  if (faces.size() * kMany < place_.size()) {
    for (std::size_t i = 0; i < faces.size(); ++i) change(faces[i], boxes[i]);
    return;
  }
  for (std::size_t i = 0; i < faces.size(); ++i) boxes_[slot_of(faces[i])] = boxes[i];
  for (std::size_t leaf = 0; leaf < leaves_; ++leaf) fit_leaf(leaf);
  for (std::size_t node = leaves_ - 1; node-- > 0;) nodes_[node] = fitted(node);
}

double FaceTree::extent() const {
  double sum = 0;
  for (std::size_t leaf = 0; leaf < leaves_; ++leaf) {
    const Box& box = nodes_[leaves_ - 1 + leaf];
    if (box.empty()) continue;
    const glm::dvec3 size = box.upper - box.lower;
    sum += size.x + size.y + size.z;
  }
  return sum;
}

void FaceTree::change(std::uint32_t face, const Box& box) {
  const std::size_t slot = slot_of(face), leaf = slot / slots_of_leaf_;
  boxes_[slot] = box;
  fit_leaf(leaf);
  for (std::size_t node = leaves_ - 1 + leaf; node > 0;) {
    node = (node - 1) / 2;
    const Box box_of_both = fitted(node);
    if (same(box_of_both, nodes_[node])) return;
    nodes_[node] = box_of_both;
  }
}

}  // namespace tolvol
