// SPDX-License-Identifier: GPL-3.0-or-later
/// Shows the progress of a long call to another thread, and lets that thread stop it. Atomics are polled; there are no
/// callbacks.
#pragma once

#include <atomic>
#include <cstddef>

#include "base/errors.h"

namespace tolvol {

class Progress {
 public:
  /// The share of the current stage that is done, 0 to 1.
  double fraction() const { return fraction_.load(std::memory_order_relaxed); }
  /// The name of the current stage, a string literal.
  const char* stage() const { return stage_.load(std::memory_order_relaxed); }
  /// A number that the stage counts. In a decimation it is the number of triangles left.
  std::size_t count() const { return count_.load(std::memory_order_relaxed); }
  void set_count(std::size_t count) { count_.store(count, std::memory_order_relaxed); }
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  /// Asks a call that improves its result step by step to return the result that it has.
  void finish() { finishing_.store(true, std::memory_order_relaxed); }
  bool finishing() const { return finishing_.load(std::memory_order_relaxed); }

  /// While it lives, the fractions of all stages are shown as the part from `first` to `last`, at least 0 and at most
  /// 1, of what would be shown without it: so the fraction grows over several loops, or calls, that are one stage to
  /// the user. It has to begin and end on the thread that makes the calls. `progress` may be null.
  class Part {
   public:
    Part(Progress* progress, double first, double last) : progress_(progress) {
      if (!progress_) return;
      first_ = progress_->first_, last_ = progress_->last_;
      progress_->first_ = first_ + first * (last_ - first_), progress_->last_ = first_ + last * (last_ - first_);
    }
    ~Part() {
      if (progress_) progress_->first_ = first_, progress_->last_ = last_;
    }
    Part(const Part&) = delete;
    Part& operator=(const Part&) = delete;

   private:
    Progress* progress_;
    double first_ = 0, last_ = 1;  // are what they were before
  };

  void begin(const char* stage) {
    fraction_.store(first_, std::memory_order_relaxed);
    stage_.store(stage, std::memory_order_relaxed);
  }
  /// This is cheap enough to be called every few thousand steps. The fraction of a stage never falls, whichever thread
  /// is the last to update it. Throws Cancelled once cancel() was called.
  void update(double fraction) {
    const double shown = first_ + fraction * (last_ - first_);
    double before = fraction_.load(std::memory_order_relaxed);
    while (before < shown && !fraction_.compare_exchange_weak(before, shown, std::memory_order_relaxed)) {
    }
    poll();
  }
  void poll() const {
    if (cancelled()) throw Cancelled();
  }

 private:
  double first_ = 0, last_ = 1;
  std::atomic<double> fraction_{0};
  std::atomic<const char*> stage_{""};
  std::atomic<std::size_t> count_{0};
  std::atomic<bool> cancelled_{false}, finishing_{false};
};

}  // namespace tolvol
