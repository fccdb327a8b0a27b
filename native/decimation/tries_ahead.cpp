// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/tries_ahead.h"

#include <algorithm>
#include <cassert>

namespace tolvol {

TriesAhead::TriesAhead(Team& team, std::size_t slots, std::size_t step_count, std::size_t vertex_count)
    : team_(&team), slots_(slots), slot_of_(step_count, 0), changed_(vertex_count, 0) {}

std::size_t TriesAhead::take(std::span<const std::uint32_t> steps) {
  assert(steps.size() <= slots_.size());
  const std::size_t first = next_;
  for (const std::uint32_t step : steps) {
    slot_of_[step] = static_cast<std::uint32_t>(next_);
    slots_[next_] = {step, now_, boxes_.size()};
    next_ = (next_ + 1) % slots_.size();
  }
  return first;
}

std::optional<std::size_t> TriesAhead::slot_of(std::uint32_t step) const {
  if (alone() || slots_[slot_of_[step]].step != step) return std::nullopt;
  return slot_of_[step];
}

bool TriesAhead::changed_since(std::size_t slot, std::span<const std::uint32_t> read) const {
  return std::ranges::any_of(read, [&](std::uint32_t vertex) { return changed_[vertex] > slots_[slot].at; });
}

std::optional<std::size_t> TriesAhead::found(std::uint32_t step, std::span<const std::uint32_t> read) const {
  const std::optional<std::size_t> slot = slot_of(step);
  return slot && changed_since(*slot, read) ? std::nullopt : slot;
}

bool TriesAhead::changed_since(std::size_t slot, const Box& box) const {
  if (alone()) return false;
  const std::span<const Box> since = std::span(boxes_).subspan(slots_[slot].boxes);
  return std::ranges::any_of(since, [&](const Box& changed) { return meet(changed, box); });
}

void TriesAhead::drop(std::uint32_t step) {
  if (alone()) return;
  Slot& slot = slots_[slot_of_[step]];
  if (slot.step == step) slot.step = kNoStep;
}

void TriesAhead::drop_all() { std::ranges::fill(slots_, Slot()); }

}  // namespace tolvol
