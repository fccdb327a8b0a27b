// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/call.h"

#include <utility>

namespace tolvol {

Call::Call(const Progress* progress, std::function<bool()> asks)
    : progress_(progress), asks_(std::move(asks)), outer_(std::exchange(current_, this)) {}

Call::~Call() { current_ = outer_; }

void Call::poll() {
  for (Call* call = this; call; call = call->outer_) {
    if (call->asks_ && !call->stopped() && call->owner_ == std::this_thread::get_id() && call->asks_()) {
      call->stopped_.store(true, std::memory_order_relaxed);
    }
    if (call->stopped() || (call->progress_ && call->progress_->cancelled())) throw Cancelled();
  }
}

}  // namespace tolvol
