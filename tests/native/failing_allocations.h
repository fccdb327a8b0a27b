// SPDX-License-Identifier: GPL-3.0-or-later
/// An operation while the n-th allocation fails, for all n of its run, for those of each place in the code, or for n
/// that grow by a share of themselves. failing_allocations.cpp replaces operator new for the whole program.
#pragma once

#include <atomic>
#include <functional>
#include <set>
#include <vector>

#include "many.h"

namespace tolvol::allocations {

inline std::atomic<long> allocations_left{-1};  // the one after these fails; negative: none does

/// Where an operation ended, in numbers.
using Numbers = std::vector<double>;

constexpr double kLeastGrowth = kSanitized ? 0.5 : 0;

/// Calls `operation` with the n-th allocation failing, until a run has no n-th: after each the next call must give what
/// it gave at first. `growth`: n grows by so much of itself, for what takes long; at least by kLeastGrowth. Returns how
/// many allocations there were, at least.
long fail_allocations(const std::function<Numbers()>& operation, double growth = 0);

/// The first, the second and the last allocation of each place: of the same line, called from the same lines.
/// `operation` must work on one thread, in the same way each time.
struct Places {
  explicit Places(const std::function<void()>& operation);

  std::set<long> chosen;
  long number = 0, allocations = 0;
};

/// Does as fail_allocations(), on one thread, with the allocations of Places; in a full run with all of them. Returns
/// the number of places, or of allocations.
long fail_each_place(const std::function<Numbers()>& operation);

}  // namespace tolvol::allocations
