// SPDX-License-Identifier: GPL-3.0-or-later
/// How a long call stops wherever it is: whoever begins it opens a Call, and the loops deep inside, which are handed
/// nothing, poll. Threads of a Team poll for the call they work for.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <thread>
#include <vector>

#include "base/progress.h"

namespace tolvol {

class Call {
 public:
  /// For as long as it lives, polls on this thread throw Cancelled once `progress` (may be null) is cancelled, once
  /// `asks`, called at every poll on this thread, has returned true, or where polls of the call around it would.
  explicit Call(const Progress* progress, std::function<bool()> asks = {});
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// Whether `asks` has returned true.
  bool stopped() const { return stopped_.load(std::memory_order_relaxed); }
  /// Throws Cancelled as above.
  void poll();

  /// The innermost call that this thread works for; null for none.
  static Call* current() { return current_; }

  /// Has this thread work for another's call, or for none: nothing that may not end halfway polls then.
  class Within {
   public:
    explicit Within(Call* call) : before_(current_) { current_ = call; }
    ~Within() { current_ = before_; }
    Within(const Within&) = delete;
    Within& operator=(const Within&) = delete;

   private:
    Call* before_;
  };

 private:
  static inline thread_local Call* current_ = nullptr;

  const Progress* progress_;
  std::function<bool()> asks_;
  std::atomic<bool> stopped_{false};
  const std::thread::id owner_ = std::this_thread::get_id();
  Call* const outer_;
};

/// For loops of any length: once in at most a few hundred microseconds of work. A few nanoseconds. Throws Cancelled.
inline void poll() {
  if (Call* const call = Call::current()) call->poll();
}

/// For loops whose turns are too short for that: polls at every 4096th.
inline void poll_at(std::size_t turn) {
  if (turn % 4096 == 0) poll();
}

/// Elements of a long array that are written between two polls: the system, too, takes its time to provide the memory.
inline constexpr std::size_t kFilledAtOnce = std::size_t{1} << 20;

/// As values.assign(count, value), with polls in between.
template <class Value>
void fill(std::vector<Value>& values, std::size_t count, const Value& value) {
  values.clear();
  values.reserve(count);
  while (values.size() < count) {
    poll();
    values.resize(std::min(count, values.size() + kFilledAtOnce), value);
  }
}

/// A copy of values, with polls in between.
template <class Value>
std::vector<Value> copied(const std::vector<Value>& values) {
  std::vector<Value> copy;
  copy.reserve(values.size());
  while (copy.size() < values.size()) {
    poll();
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(copy.size());
    copy.insert(copy.end(), from,
                from + static_cast<std::ptrdiff_t>(std::min(kFilledAtOnce, values.size() - copy.size())));
  }
  return copy;
}

}  // namespace tolvol
