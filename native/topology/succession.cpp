// SPDX-License-Identifier: GPL-3.0-or-later
// To meet the needs with as few members as possible is a set cover, which nobody solves fast; this is the usual greedy
// choice.
#include "topology/succession.h"

#include <algorithm>

namespace tolvol {

std::optional<std::vector<std::uint32_t>> Succession::find() const {
  std::vector<const Need*> order;
  order.reserve(needs_.size());
  for (const Need& need : needs_) order.push_back(&need);
  std::ranges::stable_sort(order, {}, [](const Need* need) { return need->members.size(); });
  std::vector<std::uint32_t> owners = owners_;
  std::vector<bool> taken = kept_;
  for (const Need* const need : order) {
    const auto serves = [&](std::uint32_t member) { return taken[member] && owners[member] == need->face; };
    const auto free_own = [&](std::uint32_t member) { return !taken[member] && owners[member] == need->face; };
    const auto free = [&](std::uint32_t member) { return !taken[member]; };
    if (std::ranges::any_of(need->members, serves)) continue;
    auto chosen = std::ranges::find_if(need->members, free_own);
    if (chosen == need->members.end()) chosen = std::ranges::find_if(need->members, free);
    if (chosen == need->members.end()) return std::nullopt;
    taken[*chosen] = true;
    owners[*chosen] = need->face;
  }
  return owners;
}

}  // namespace tolvol
