// SPDX-License-Identifier: GPL-3.0-or-later
/// Steps that are tried before their turn, several at once on the threads of a team. A try only reads. What it found is
/// used when the turn of its step comes, unless something that it read has changed meanwhile: what is carried out, and
/// in which order, is the same for any number of threads.
///
/// The caller decides which steps come next and what a try finds, and keeps one result for each slot.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class TriesAhead {
 public:
  /// For one thread, which tries a step when its turn comes. There is one slot.
  TriesAhead() = default;
  /// Steps and vertices are numbered up to these counts. `slots`: how many of the last tries are kept. Keeps a
  /// reference to `team`, which has other threads than the caller's.
  TriesAhead(Team& team, std::size_t slots, std::size_t step_count, std::size_t vertex_count);

  bool alone() const { return !team_; }
  std::size_t slot_count() const { return alone() ? 1 : slots_.size(); }

  /// The time, which goes on with every change.
  std::uint64_t now() const { return now_; }
  void advance() { ++now_; }
  /// Something in a box of space has changed now. The box may be empty.
  void note_change(const Box& box) {
    if (!alone() && !box.empty()) boxes_.push_back(box);
  }
  /// Whether something in the box has changed since the try in a slot.
  bool changed_since(std::size_t slot, const Box& box) const;

  /// What a try reads around the vertex has changed now.
  void note_change(std::uint32_t vertex) {
    if (!alone()) changed_[vertex] = now_;
  }

  /// Tries some steps now, by try_step(step, slot) for each; returns the slot of the first. The slots that were taken
  /// longest ago are taken for them: there must be as many.
  template <class Try>
  std::size_t run(std::span<const std::uint32_t> steps, Try&& try_step) {
    if (alone()) return try_step(steps.front(), 0), 0;
    const std::size_t first = take(steps);
    team_->run(steps.size(), 1, [&](std::size_t i, std::size_t) { try_step(steps[i], (first + i) % slots_.size()); });
    return first;
  }
  /// The slot of what was found for a step, unless a vertex around which its try read has changed since.
  std::optional<std::size_t> found(std::uint32_t step, std::span<const std::uint32_t> read) const;
  /// The slot of what was found for a step, and whether a vertex around which its try read has changed since.
  std::optional<std::size_t> slot_of(std::uint32_t step) const;
  bool changed_since(std::size_t slot, std::span<const std::uint32_t> read) const;

  /// What was found for a step, or for all of them, is not used again.
  void drop(std::uint32_t step);
  void drop_all();

 private:
  static constexpr std::uint32_t kNoStep = std::numeric_limits<std::uint32_t>::max();
  struct Slot {
    std::uint32_t step = kNoStep;
    std::uint64_t at = 0;   ///< When it was tried.
    std::size_t boxes = 0;  ///< How many boxes had changed by then.
  };

  std::size_t take(std::span<const std::uint32_t> steps);

  Team* team_ = nullptr;  ///< Null for one thread.
  std::uint64_t now_ = 1;
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> slot_of_;  ///< For each step: its slot, if that slot names the step.
  std::size_t next_ = 0;                ///< The slot that is taken next.
  std::vector<Box> boxes_;              ///< The boxes in which something has changed, in order.
  std::vector<std::uint64_t> changed_;  ///< For each vertex: when what is around it changed last.
};

}  // namespace tolvol
