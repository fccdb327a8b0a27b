// SPDX-License-Identifier: GPL-3.0-or-later
/// Polls of a call (base/call.h), counted: a measure of its work that is the same on every machine.
#pragma once

#include <atomic>
#include <cstddef>

#include "base/call.h"

namespace tolvol {

/// From the `last`-th poll on the call is asked to stop.
struct Counted {
  std::atomic<std::size_t> polls = 0;  ///< Several threads poll.
  std::size_t last;
  const Call call;

  explicit Counted(std::size_t last_poll = static_cast<std::size_t>(-1))
      : last(last_poll), call(nullptr, [this] { return ++polls >= last; }) {}
};

template <class Run>
std::size_t polls_of(Run&& run) {
  const Counted whole;
  run();
  return whole.polls;
}

}  // namespace tolvol
