// SPDX-License-Identifier: GPL-3.0-or-later
/// Fork and join over an index range. The number of threads never changes a result.
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

/// A team has at most this many threads. Threads that often wait for each other gain nothing from more.
inline constexpr unsigned kMostThreads = 16;

/// Returns the number of threads to use. 0 means one for each core. More threads than cores, and more than
/// kMostThreads, would only cost memory and time.
inline unsigned thread_count(unsigned wanted) {
  const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
  return wanted ? std::min(wanted, std::max(cores, kMostThreads)) : cores;
}

/// Threads that wait between the loops that they share, for loops too short to start threads for. A team serves one
/// caller at a time.
class Team {
 public:
  /// `threads` includes the caller's. The team has fewer if the system starts no more or has no memory for them.
  explicit Team(unsigned threads);
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  /// The number of threads, including the caller's.
  std::size_t size() const { return helpers_.size() + 1; }
  bool alone() const { return helpers_.empty(); }

  /// Calls body(begin, end) for blocks of [0, count), on several threads at once, so that body may write only to
  /// elements of its own indices. The first exception is rethrown after the join. Each thread polls before each block,
  /// for the call that the caller works for. A loop takes about 1 us, and 50 us if the other threads sleep.
  template <class Body>
  void run(std::size_t count, std::size_t block, Body&& body) {
    // The cast back restores the type of `body`, const or not.
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
  Loop* open_ = nullptr;                ///< is null once the loop is done, for a helper that wakes too late
  std::atomic<std::size_t> loops_{0};   ///< counts the loops that were begun
  std::atomic<std::size_t> inside_{0};  ///< counts the helpers in the open loop
  std::atomic<bool> ends_{false};
  std::vector<std::thread> helpers_;
};

/// Runs one loop on up to `threads` threads, like Team::run().
template <class Body>
void parallel_for(std::size_t count, std::size_t block, unsigned threads, Body&& body) {
  const std::size_t blocks = (count + block - 1) / block;
  Team(static_cast<unsigned>(std::min<std::size_t>(thread_count(threads), blocks))).run(count, block, body);
}

}  // namespace tolvol
