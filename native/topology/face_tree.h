// SPDX-License-Identifier: GPL-3.0-or-later
/// The boxes of a mesh's faces, to find the faces near a place while faces change and vanish.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <type_traits>
#include <vector>

#include "base/call.h"
#include "base/parallel.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// A balanced tree of boxes, cut at medians. Several threads may search it at once while none changes it. Which faces a
/// search finds depends on the boxes alone; their order also depends on the boxes that the tree was built with.
class FaceTree {
 public:
  /// A leaf has at most this many faces. Fewer would take more nodes, and no less time.
  static constexpr std::size_t kLeaf = 8;

  FaceTree() = default;
  /// `faces` are the numbers of the faces, in rising order, and `boxes` their boxes. O(n log n), about 0.2 us a
  /// face, 70 to 100 bytes, and 32 bytes more while it is built.
  FaceTree(std::span<const std::uint32_t> faces, std::span<const Box> boxes, Team& team)
      : FaceTree(
            faces, [boxes](std::size_t i) { return boxes[i]; }, team) {}
  /// The same with box(i) for the box of faces[i], which is asked for twice.
  FaceTree(std::span<const std::uint32_t> faces, const std::function<Box(std::size_t)>& box, Team& team);

  /// Gives a face of the constructor's another box; an empty one removes the face. O(log n).
  void change(std::uint32_t face, const Box& box);
  /// Gives many of these faces other boxes. O(log n) a face, or about 10 ns for each face of the tree where that is
  /// less.
  void change(std::span<const std::uint32_t> faces, std::span<const Box> boxes);

  /// A box around all faces, which is empty if there are none.
  Box box() const { return nodes_.empty() ? Box() : nodes_.front(); }

  /// The sum of the sizes of the leaves' boxes along the axes: the larger it has become since the tree was built, the
  /// more a search has to look at.
  double extent() const;

  /// Calls visit(face) for every face whose box meets `box`, and for no other. A visit that returns false ends the
  /// search.
  template <class Visit>
  void for_each_meeting(const Box& box, Visit&& visit) const {
    for_each_where([&](const Box& of_faces) { return meet(of_faces, box); }, visit);
  }
  /// The same for every face for whose box `may` holds. It has to hold of every box around such a box, too, and of no
  /// empty one.
  template <class May, class Visit>
  void for_each_where(May&& may, Visit&& visit) const;

  /// The number of leaves, by which for_each_pair() is called to find all pairs.
  std::size_t leaf_count() const { return leaves_; }
  /// Calls visit(a, b) for each pair of faces whose boxes meet and of which one is in this leaf and the other in this
  /// or a later one. All leaves together give each pair once, in two thirds of the time of a search for each face. A
  /// visit that returns false ends the search of the leaf.
  template <class Visit>
  void for_each_pair(std::size_t leaf, Visit&& visit) const;

 private:
  std::size_t slot_of(std::uint32_t face) const;
  void fit_leaf(std::size_t leaf);
  Box fitted(std::size_t node) const;

  std::size_t leaves_ = 0;              ///< a power of two, or 0 without faces
  std::vector<Box> nodes_;              ///< the root first; the children of node i are 2 i + 1 and 2 i + 2; leaves last
  std::size_t slots_of_leaf_ = 0;       ///< the number of slots of each leaf: the most faces in one
  std::vector<Box> boxes_;              ///< per slot; empty where the leaf has fewer faces
  std::vector<std::uint32_t> numbers_;  ///< per slot: its face
  std::vector<std::uint32_t> faces_;    ///< in rising order; empty if the numbers are 0, 1, 2 and so on
  std::vector<std::uint32_t> place_;    ///< per face, in that order: its slot
};

template <class May, class Visit>
void FaceTree::for_each_where(May&& may, Visit&& visit) const {
  if (leaves_ == 0) return;
  std::array<std::uint32_t, 66> stack;  // at most one node a level waits beside the next: 32 levels
  std::size_t height = 0;
  stack[height++] = 0;
  while (height > 0) {
    const std::uint32_t node = stack[--height];
    if (!may(nodes_[node])) continue;
    if (node + 1 < leaves_) {
      stack[height++] = 2 * node + 2, stack[height++] = 2 * node + 1;
      continue;
    }
    const std::size_t first = (node + 1 - leaves_) * slots_of_leaf_;
    for (std::size_t i = first; i < first + slots_of_leaf_; ++i) {
      if (!may(boxes_[i])) continue;
      if constexpr (std::is_same_v<decltype(visit(numbers_[i])), bool>) {
        if (!visit(numbers_[i])) return;
      } else {
        visit(numbers_[i]);
      }
    }
  }
}

template <class Visit>
void FaceTree::for_each_pair(std::size_t leaf, Visit&& visit) const {
  struct Subtree {
    std::size_t node, first, count;  // of the leaves
  };
  const Box& own = nodes_[leaves_ - 1 + leaf];
  std::array<Subtree, 66> stack;
  std::size_t height = 0, met = 0;
  stack[height++] = {0, 0, leaves_};
  while (height > 0) {
    const auto [node, first, count] = stack[--height];
    // The pairs with faces of an earlier leaf are that leaf's.
    if (first + count <= leaf || !meet(nodes_[node], own)) continue;
    if (count > 1) {
      const std::size_t half = count / 2;
      stack[height++] = {2 * node + 2, first + half, half}, stack[height++] = {2 * node + 1, first, half};
      continue;
    }
    poll_at(++met);
    for (std::size_t i = leaf * slots_of_leaf_; i < (leaf + 1) * slots_of_leaf_; ++i) {
      if (!meet(boxes_[i], nodes_[node])) continue;
      for (std::size_t k = first == leaf ? i + 1 : first * slots_of_leaf_; k < (first + 1) * slots_of_leaf_; ++k) {
        if (meet(boxes_[i], boxes_[k]) && !visit(numbers_[i], numbers_[k])) return;
      }
    }
  }
}

}  // namespace tolvol
