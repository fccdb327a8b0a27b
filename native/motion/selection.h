// SPDX-License-Identifier: GPL-3.0-or-later
/// Chooses numbers of vertices and faces on several threads, in an order that does not depend on them.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"

namespace tolvol {

/// The numbers of faces or vertices that a thread takes at a time, for work of about 10 ns each and of 1 us
/// or more.
inline constexpr std::size_t kManyAtOnce = 1024, kFewAtOnce = 32;

/// The least index in [0, count) for which hits(i) holds; count when there is none.
template <class Hits>
std::size_t first_of(std::size_t count, unsigned threads, Hits&& hits) {
  std::atomic<std::size_t> least{count};
  parallel_for(count, kManyAtOnce, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!hits(i)) continue;
      for (std::size_t known = least; i < known && !least.compare_exchange_weak(known, i);) {
      }
    }
  });
  return least;
}

/// The indices in [0, count) for which choose(i) holds, ascending.
template <class Choose>
std::vector<std::uint32_t> select(std::size_t count, unsigned threads, Choose&& choose) {
  std::vector<std::vector<std::uint32_t>> chosen((count + kManyAtOnce - 1) / kManyAtOnce);
  parallel_for(count, kManyAtOnce, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (choose(i)) chosen[begin / kManyAtOnce].push_back(static_cast<std::uint32_t>(i));
    }
  });
  std::vector<std::uint32_t> result;
  for (const std::vector<std::uint32_t>& part : chosen) result.insert(result.end(), part.begin(), part.end());
  return result;
}

/// Those that are marked.
inline std::vector<std::uint32_t> chosen(std::span<const std::uint32_t> from, std::span<const std::uint8_t> marked) {
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (marked[i]) result.push_back(from[i]);
  }
  return result;
}

}  // namespace tolvol
