// SPDX-License-Identifier: GPL-3.0-or-later
/// The input faces that each face of a changing mesh stands for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tolvol {

/// A face stands for itself at first. A face that is removed hands what it stands for to another, its successor, so
/// that every input face is stood for by one face, always. Changes of different faces may run side by side.
class FaceOrigins {
 public:
  FaceOrigins() = default;
  explicit FaceOrigins(std::size_t faces) : next_(faces, kNone), last_(faces) {
    for (std::uint32_t i = 0; i < faces; ++i) last_[i] = i;
  }

  /// O(1).
  void hand_over(std::uint32_t removed, std::uint32_t successor) {
    next_[last_[successor]] = removed;
    last_[successor] = last_[removed];
  }

  /// Calls visit(input face) for those that a face stands for. A visit that returns false ends the walk.
  template <class Visit>
  void for_each(std::uint32_t face, Visit&& visit) const {
    for (std::uint32_t i = face; i != kNone && visit(i); i = next_[i]) continue;
  }

  /// What restore() needs to undo every hand_over() to the face from now on.
  std::uint32_t state(std::uint32_t face) const { return last_[face]; }
  void restore(std::uint32_t face, std::uint32_t state) {
    last_[face] = state;
    next_[state] = kNone;
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  std::vector<std::uint32_t> next_;  ///< the input face that comes after one in the list of the face that has both
  std::vector<std::uint32_t> last_;  ///< per face: the end of its list
};

}  // namespace tolvol
