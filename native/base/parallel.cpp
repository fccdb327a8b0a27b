// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/parallel.h"

#include <algorithm>
#include <chrono>
#include <new>
#include <system_error>

namespace tolvol {
namespace {

/// A thread yields this often before it goes to sleep, because the next loop or the end of this one is often near.
constexpr int kPatience = 2000;
/// A caller that waits for the other threads polls once in this time.
constexpr std::chrono::milliseconds kBetweenPolls(20);

template <class Condition>
void wait_a_little(Condition&& condition) {
  for (int i = 0; i < kPatience && !condition(); ++i) std::this_thread::yield();
}

}  // namespace

Team::Team(unsigned threads) {
  // The threads that do start, and the caller, do the work. An exception that left here would end the process, because
  // the destructor of a running thread does.
  try {
    for (unsigned i = 1; i < threads; ++i) helpers_.emplace_back([this] { help(); });
  } catch (const std::system_error&) {
  } catch (const std::bad_alloc&) {
  }
}

Team::~Team() {
  {
    std::lock_guard lock(mutex_);
    ends_ = true;
  }
  wake_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

void Team::run(Loop& loop) {
  const bool shared = !alone() && loop.count > loop.block;
  if (shared) {
    {
      std::lock_guard lock(mutex_);
      open_ = &loop;
      ++loops_;
    }
    wake_.notify_all();
  }
  work(loop);
  if (shared) {
    {
      std::lock_guard lock(mutex_);
      open_ = nullptr;
    }
    const auto left = [&] { return inside_ == 0; };
    wait_a_little(left);
    std::unique_lock lock(mutex_);
    while (!left_.wait_for(lock, kBetweenPolls, left)) {
      lock.unlock();
      try {
        poll();
      } catch (...) {
        fail(loop);  // the others stop at their next poll
      }
      lock.lock();
    }
  }
  if (loop.error) std::rethrow_exception(loop.error);
}

void Team::work(Loop& loop) {
  try {
    for (std::size_t begin; (begin = loop.next.fetch_add(loop.block)) < loop.count;) {
      poll();
      loop.call(loop.body, begin, std::min(begin + loop.block, loop.count));
    }
  } catch (...) {
    fail(loop);
  }
}

/// Ends the loop with the exception that is being handled.
void Team::fail(Loop& loop) {
  std::lock_guard lock(mutex_);
  if (!loop.error) loop.error = std::current_exception();
  loop.next = loop.count;
}

void Team::help() {
  for (std::size_t seen = 0;;) {
    const auto called = [&] { return ends_ || loops_ != seen; };
    wait_a_little(called);
    std::unique_lock lock(mutex_);
    wake_.wait(lock, called);
    if (ends_) return;
    seen = loops_;
    if (!open_) continue;
    Loop& loop = *open_;
    ++inside_;
    lock.unlock();
    {
      const Call::Within within(loop.call_of_caller);
      work(loop);
    }
    lock.lock();
    --inside_;
    left_.notify_one();
  }
}

}  // namespace tolvol
