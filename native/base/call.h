// SPDX-License-Identifier: GPL-3.0-or-later
/// A long call stops wherever it is: the function that begins it opens a Call, and the loops deep inside poll, without
/// being handed anything. Threads of a Team poll for the call that they work for.
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
  /// For as long as the call lives, polls on this thread throw Cancelled once `progress` (may be null) is cancelled,
  /// once `asks`, which is called at every poll on this thread, has returned true, or if polls of the outer call throw.
  explicit Call(const Progress* progress, std::function<bool()> asks = {});
  ~Call();
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  /// Tells whether `asks` has returned true.
  bool stopped() const { return stopped_.load(std::memory_order_relaxed); }
  /// Throws Cancelled in the cases above.
  void poll();

  /// Returns the innermost call that this thread works for, or null.
  static Call* current() { return current_; }

  /// Lets this thread work for another thread's call, or for none, so that code that must not end halfway never throws.
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

/// Loops of any length call this once in at most a few hundred microseconds. It takes a few nanoseconds. Throws
/// Cancelled.
inline void poll() {
  if (Call* const call = Call::current()) call->poll();
}

/// Polls at every 4096th turn, for loops whose turns are too short for poll().
inline void poll_at(std::size_t turn) {
  if (turn % 4096 == 0) poll();
}

/// This many elements of a long array are written between two polls. The system takes time to provide their memory.
inline constexpr std::size_t kFilledAtOnce = std::size_t{1} << 20;

/// Does the same as values.assign(count, value), with polls in between.
template <class Value>
void fill(std::vector<Value>& values, std::size_t count, const Value& value) {
  values.clear();
  values.reserve(count);
  while (values.size() < count) {
    poll();
    values.resize(std::min(count, values.size() + kFilledAtOnce), value);
  }
}

/// Returns a copy of values, with polls in between.
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
