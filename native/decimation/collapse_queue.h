// SPDX-License-Identifier: GPL-3.0-or-later
/// Edges in the order of their costs, cheapest first; ties go to the lower edge, so that the order is the same
/// everywhere.
///
/// Costs are sorted into buckets as they come, and only the bucket whose turn it is becomes a heap: one small enough
/// for the cache, made of what has not been renewed meanwhile.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tolvol {

class CollapseQueue {
 public:
  struct Entry {
    double cost;
    std::uint32_t edge;
  };

  /// `stamps`: per edge, of all queues that its entries were ever in.
  explicit CollapseQueue(std::span<std::uint32_t> stamps);

  /// Instead of the edge's former entry. Costs are finite.
  void push(std::uint32_t edge, double cost);
  /// Takes the edge's entry out, if it has one.
  void drop(std::uint32_t edge) { ++stamps_[edge]; }
  std::optional<Entry> pop();

 private:
  struct Stamped {
    double cost;
    std::uint32_t edge, stamp;
  };
  static bool later(const Stamped& a, const Stamped& b) {
    return a.cost > b.cost || (a.cost == b.cost && a.edge > b.edge);
  }

  std::vector<std::vector<Stamped>> buckets_;
  std::size_t open_ = 0;  ///< buckets before this one are in the heap
  std::vector<Stamped> heap_;
  std::span<std::uint32_t> stamps_;  ///< per edge: an entry with another one is out of date
};

}  // namespace tolvol
