// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/collapse_queue.h"

#include <algorithm>
#include <bit>

namespace tolvol {
namespace {

constexpr int kBucketBits =
    15;  // The sign, the exponent and three bits of the mantissa: eight buckets for each octave.

std::size_t bucket_of(double cost) {
  // The bits of doubles are ordered as the doubles are; those of negative doubles are ordered the other way around.
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(cost), sign = std::uint64_t{1} << 63;
  return (bits & sign ? ~bits : bits | sign) >> (64 - kBucketBits);
}

}  // namespace

CollapseQueue::CollapseQueue(std::span<std::uint32_t> stamps)
    : buckets_(std::size_t{1} << kBucketBits), stamps_(stamps) {}

void CollapseQueue::push(std::uint32_t edge, double cost) {
  cost += 0.0;  // This turns the negative zero into the positive one: equal costs must be in one bucket.
  const Stamped entry{cost, edge, ++stamps_[edge]};
  const std::size_t bucket = bucket_of(cost);
  if (bucket >= open_) {
    buckets_[bucket].push_back(entry);
    return;
  }
  heap_.push_back(entry);
  std::push_heap(heap_.begin(), heap_.end(), later);
}

std::optional<CollapseQueue::Entry> CollapseQueue::pop() {
  for (;;) {
    while (!heap_.empty()) {
      std::pop_heap(heap_.begin(), heap_.end(), later);
      const Stamped entry = heap_.back();
      heap_.pop_back();
      if (entry.stamp != stamps_[entry.edge]) continue;
      ++stamps_[entry.edge];
      return Entry{entry.cost, entry.edge};
    }
    while (open_ < buckets_.size() && buckets_[open_].empty()) ++open_;
    if (open_ == buckets_.size()) return std::nullopt;
    for (const Stamped& entry : buckets_[open_]) {
      if (entry.stamp == stamps_[entry.edge]) heap_.push_back(entry);
    }
    std::vector<Stamped>().swap(buckets_[open_++]);
    std::make_heap(heap_.begin(), heap_.end(), later);
  }
}

}  // namespace tolvol
