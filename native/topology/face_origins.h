// SPDX-License-Identifier: GPL-3.0-or-later
/// The input faces that each face of a changing mesh stands for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tolvol {

/// A face stands for itself at first. A face that is removed hands what it stands for to another, its successor, and
/// one face may give a part of it to another, so that every input face is stood for by one face, always. Changes of
/// different faces may run side by side.
class FaceOrigins {
 public:
  FaceOrigins() = default;
  explicit FaceOrigins(std::size_t faces) : next_(faces, kNone), first_(faces), last_(faces) {
    for (std::uint32_t i = 0; i < faces; ++i) first_[i] = last_[i] = i;
  }

  /// O(1).
  void hand_over(std::uint32_t removed, std::uint32_t successor) {
    if (first_[removed] == kNone) return;
    append(successor, first_[removed], last_[removed]);
  }

  /// Makes the face `to` stand for an input face that `from` stands for. O(k) for k faces that `from` stands for.
  void give(std::uint32_t input_face, std::uint32_t from, std::uint32_t to) {
    std::uint32_t before = kNone;
    for (std::uint32_t i = first_[from]; i != input_face; i = next_[i]) before = i;
    (before == kNone ? first_[from] : next_[before]) = next_[input_face];
    if (last_[from] == input_face) last_[from] = before;
    next_[input_face] = kNone;
    append(to, input_face, input_face);
  }

  /// Calls visit(input face) for those that a face stands for. A visit that returns false ends the walk.
  template <class Visit>
  void for_each(std::uint32_t face, Visit&& visit) const {
    for (std::uint32_t i = first_[face]; i != kNone && visit(i); i = next_[i]) continue;
  }

  /// What restore() needs to undo every hand_over() to the face from now on, where nothing was given from it.
  std::uint32_t state(std::uint32_t face) const { return last_[face]; }
  void restore(std::uint32_t face, std::uint32_t state) {
    last_[face] = state;
    (state == kNone ? first_[face] : next_[state]) = kNone;
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  void append(std::uint32_t face, std::uint32_t first, std::uint32_t last) {
    (first_[face] == kNone ? first_[face] : next_[last_[face]]) = first;
    last_[face] = last;
  }

  std::vector<std::uint32_t> next_;  ///< the input face that comes after one in the list of the face that has both
  std::vector<std::uint32_t> first_, last_;  ///< per face: the ends of its list; kNone where it is empty
};

}  // namespace tolvol
