// SPDX-License-Identifier: GPL-3.0-or-later
/// Fork and join over an index range; what runs where never changes a result.
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

#include "base/call.h"

namespace tolvol {

/// Threads that wait for each other often gain nothing from more.
inline constexpr unsigned kMostThreads = 16;

/// 0 means one per core. More than there are cores, and more than kMostThreads, would only cost memory and time.
inline unsigned thread_count(unsigned wanted) {
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  return wanted ? std::min(wanted, std::max(cores, kMostThreads)) : cores;
}

/// Threads that wait between the loops they share, for loops too short to start threads for. One caller at a time.
class Team {
 public:
  /// `threads`: the caller's among them. Fewer where the system starts no more, or has no memory for them.
  explicit Team(unsigned threads);
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  /// Threads, the caller's among them.
  std::size_t size() const { return helpers_.size() + 1; }
  bool alone() const { return helpers_.empty(); }

  /// Calls body(begin, end) for blocks of [0, count). Blocks are handed out in order, so body must write only to what
  /// its own indices own. The first exception is rethrown after the join. Polls before each block, for the call that
  /// the caller works for. About 1 us, and 50 us when the others sleep.
  template <class Body>
  void run(std::size_t count, std::size_t block, Body&& body) {
    // A body that is const comes back as it was.
    Loop loop{count, block, const_cast<void*>(static_cast<const void*>(&body)),
              [](void* b, std::size_t begin, std::size_t end) {
                (*static_cast<std::remove_reference_t<Body>*>(b))(begin, end);
              }};
    run(loop);
  }

 private:
  struct Loop {
    std::size_t count, block;
    void* body;
    void (*call)(void* body, std::size_t begin, std::size_t end);
    std::atomic<std::size_t> next{0};
    std::exception_ptr error{};
    Call* const call_of_caller = Call::current();
  };

  void run(Loop& loop);
  void work(Loop& loop);
  void fail(Loop& loop);
  void help();

  std::mutex mutex_;
  std::condition_variable wake_, left_;
  Loop* open_ = nullptr;                ///< a helper that wakes too late finds none
  std::atomic<std::size_t> loops_{0};   ///< begun so far
  std::atomic<std::size_t> inside_{0};  ///< helpers in the open loop
  std::atomic<bool> ends_{false};
  std::vector<std::thread> helpers_;
};

/// One loop on up to `threads` threads, as Team::run().
template <class Body>
void parallel_for(std::size_t count, std::size_t block, unsigned threads, Body&& body) {
  const std::size_t blocks = (count + block - 1) / block;
  Team(static_cast<unsigned>(std::min<std::size_t>(thread_count(threads), blocks))).run(count, block, body);
}

}  // namespace tolvol
