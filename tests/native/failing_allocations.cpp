// SPDX-License-Identifier: GPL-3.0-or-later
#include "failing_allocations.h"

#include <execinfo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <new>
#include <utility>

namespace {

using tolvol::allocations::allocations_left;
using Callers = std::array<void*, 16>;
std::vector<Callers>* recorded = nullptr;  // who allocates, one after another; null: nobody wants to know

void* allocate(std::size_t size, std::size_t alignment) {
  if (std::vector<Callers>* const record = std::exchange(recorded, nullptr)) {
    Callers callers{};
    backtrace(callers.data(), int(callers.size()));
    record->push_back(callers);
    recorded = record;
  }
  // Once: what is allocated while the exception is on its way succeeds.
  if (allocations_left.load(std::memory_order_relaxed) >= 0 && allocations_left.fetch_sub(1) == 0)
    throw std::bad_alloc();
  size = (std::max<std::size_t>(size, 1) + alignment - 1) / alignment * alignment;
  if (void* const memory = std::aligned_alloc(alignment, size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size, __STDCPP_DEFAULT_NEW_ALIGNMENT__); }
void* operator new[](std::size_t size) { return allocate(size, __STDCPP_DEFAULT_NEW_ALIGNMENT__); }
void* operator new(std::size_t size, std::align_val_t alignment) { return allocate(size, std::size_t(alignment)); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return allocate(size, std::size_t(alignment)); }
// The sanitizers have allocators of their own for these, whose memory the functions below could not free.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  try {
    return operator new(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void* operator new[](std::size_t size, const std::nothrow_t& nothrow) noexcept { return operator new(size, nothrow); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace tolvol::allocations {

namespace {

/// Calls `operation` with the n-th allocation failing and then, if there was an n-th, once more: it must give what it
/// gave at first. Returns whether there was one and all is well.
bool survives(const std::function<Numbers()>& operation, long n, const Numbers& expected) {
  bool failed = false;
  allocations_left = n;
  try {
    operation();
  } catch (const std::bad_alloc&) {
    failed = true;
  }
  const bool reached = allocations_left.exchange(-1) < 0;
  EXPECT_TRUE(reached || !failed) << n;
  if (!reached) return false;
  const bool same = operation() == expected;
  EXPECT_TRUE(same) << "another result after allocation " << n << " failed";
  return same;
}

}  // namespace

long fail_allocations(const std::function<Numbers()>& operation, double growth) {
  growth = std::max(growth, kLeastGrowth);
  const Numbers expected = operation();
  EXPECT_FALSE(expected.empty());
  long n = 0;
  while (survives(operation, n, expected)) n += 1 + long(growth * double(n));
  return n;
}

Places::Places(const std::function<void()>& operation) {
  std::vector<Callers> calls;
  recorded = &calls;
  operation();
  recorded = nullptr;
  std::map<Callers, std::vector<long>> places;
  for (std::size_t n = 0; n < calls.size(); ++n) places[calls[n]].push_back(long(n));
  for (const auto& [callers, at] : places) chosen.insert({at.front(), at[at.size() > 1], at.back()});
  number = long(places.size()), allocations = long(calls.size());
}

long fail_each_place(const std::function<Numbers()>& operation) {
  if (kSanitized || is_full_run()) return fail_allocations(operation);
  const Numbers expected = operation();
  EXPECT_FALSE(expected.empty());
  const Places places([&] { operation(); });
  for (const long n : places.chosen) {
    if (!survives(operation, n, expected)) {
      ADD_FAILURE() << "allocation " << n << " of " << places.allocations;
      break;
    }
  }
  return places.number;
}

}  // namespace tolvol::allocations
