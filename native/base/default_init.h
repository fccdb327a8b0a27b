// SPDX-License-Identifier: GPL-3.0-or-later
/// Vectors whose new elements are not set to zero first, for long arrays that several threads fill: setting them to
/// zero would be work for one thread alone.
#pragma once

#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace tolvol {

/// An allocator that default-initialises: numbers, and classes whose default constructor sets nothing, keep what was in
/// the memory.
template <class T>
struct DefaultInit : std::allocator<T> {
  template <class U>
  struct rebind {  // NOLINT(readability-identifier-naming): containers ask for this name
    using other = DefaultInit<U>;
  };
  DefaultInit() = default;
  template <class U>
  DefaultInit(const DefaultInit<U>&) noexcept {}

  template <class U>
  void construct(U* place) {
    ::new (static_cast<void*>(place)) U;
  }
  template <class U, class... Arguments>
  void construct(U* place, Arguments&&... arguments) {
    ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
  }
};

/// After resize(), every new element has to be written before it is read.
template <class T>
using Unfilled = std::vector<T, DefaultInit<T>>;

}  // namespace tolvol
