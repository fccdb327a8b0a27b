// SPDX-License-Identifier: GPL-3.0-or-later
/// Fork and join over an index range; what runs where never changes a result.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace tolvol {

/// 0 means one per core.
inline unsigned thread_count(unsigned wanted) {
  return wanted ? wanted : std::max(1u, std::thread::hardware_concurrency());
}

/// Calls body(begin, end) for blocks of [0, count) on up to `threads` threads, the caller's among them. Blocks are
/// handed out in order, so body must write only to what its own indices own. The first exception is rethrown after the
/// join.
template <class Body>
void parallel_for(std::size_t count, std::size_t block, unsigned threads, Body&& body) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr error;
  std::mutex error_mutex;
  auto work = [&] {
    try {
      for (std::size_t begin; (begin = next.fetch_add(block)) < count;) body(begin, std::min(begin + block, count));
    } catch (...) {
      std::lock_guard lock(error_mutex);
      if (!error) error = std::current_exception();
      next.store(count);
    }
  };
  const std::size_t blocks = (count + block - 1) / block;
  std::vector<std::thread> helpers;
  for (unsigned i = 1; i < std::min<std::size_t>(thread_count(threads), blocks); ++i) helpers.emplace_back(work);
  work();
  for (std::thread& helper : helpers) helper.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace tolvol
