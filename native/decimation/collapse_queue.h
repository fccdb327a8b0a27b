// SPDX-License-Identifier: GPL-3.0-or-later
/// A queue of edges in the order of their costs, cheapest first. Ties go to the lower edge, so that the order is the
/// same on every machine.
///
/// Entries are sorted into buckets as they come, and only the bucket whose turn it is becomes a heap. The heap fits the
/// cache, and holds only entries that nothing has replaced meanwhile.
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

  /// `stamps` has a number for each edge. All queues that an edge was ever in share it.
  explicit CollapseQueue(std::span<std::uint32_t> stamps);

  /// Replaces the edge's former entry. Costs are finite.
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
  std::size_t open_ = 0;  ///< Buckets before this one are in the heap.
  std::vector<Stamped> heap_;
  std::span<std::uint32_t> stamps_;  ///< For each edge; an entry with another stamp is out of date.
};

}  // namespace tolvol
