// SPDX-License-Identifier: GPL-3.0-or-later
/// Sorting what a mesh has few of at each vertex: sides, triangles.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace tolvol {

/// Puts things in the order of what `before` compares, which must begin with first(thing): one pass by that, and short
/// sorts of those that share it, because a mesh has few sides or triangles that do.
template <class T, class First, class Before>
void sort_by(std::vector<T>& things, First&& first, Before&& before) {
  std::uint32_t groups = 0;
  for (const T& t : things) groups = std::max(groups, first(t) + 1);
  std::vector<std::size_t> end(groups + 1, 0);
  for (const T& t : things) ++end[first(t) + 1];
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<T> sorted(things.size());
  for (const T& t : things) sorted[end[first(t)]++] = t;
  for (std::size_t group = 0, begin = 0; group < groups; begin = end[group++]) {
    std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(begin),
              sorted.begin() + static_cast<std::ptrdiff_t>(end[group]), before);
  }
  things.swap(sorted);
}

}  // namespace tolvol
