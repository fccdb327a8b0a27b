// SPDX-License-Identifier: GPL-3.0-or-later
/// The places that vertices of a mesh occupy, so that no vertex is put where another is. A reader that welds equal
/// positions would make the two vertices one, and then more than two faces may meet at an edge.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace tolvol {

/// A hash table with open addressing, which is several times as fast as std::unordered_map: every collapse asks it. It
/// holds hashes alone. Two places with the same hash, by chance one pair in 2^64, only cost a vertex a free place.
class Occupied {
 public:
  void add(const glm::dvec3& place) {
    if (2 * (used_ + 1) > slots_.size()) grow();
    Slot& slot = slots_[index(hash(place))];
    used_ += slot.hash == 0;
    slot.hash = hash(place);
    ++slot.count;
  }
  /// Takes back one add(). The place was added.
  void remove(const glm::dvec3& place) { --slots_[index(hash(place))].count; }
  bool contains(const glm::dvec3& place) const { return !slots_.empty() && slots_[index(hash(place))].count > 0; }

 private:
  struct Slot {
    std::uint64_t hash = 0;  ///< 0: the slot is free
    std::uint32_t count = 0;
  };

  static std::uint64_t hash(const glm::dvec3& p) {
    std::uint64_t all = 0;
    for (int k = 0; k < 3; ++k) {  // by the finaliser of SplitMix64
      // The sum with 0.0 turns the negative zero into the positive one, which is equal to it.
      all = (all ^ std::bit_cast<std::uint64_t>(p[k] + 0.0)) + 0x9E3779B97F4A7C15u;
      all = (all ^ (all >> 30)) * 0xBF58476D1CE4E5B9u;
      all = (all ^ (all >> 27)) * 0x94D049BB133111EBu;
      all ^= all >> 31;
    }
    return all == 0 ? 1 : all;
  }
  /// Returns which slot has the hash, or the free one where it belongs. At least half of the slots are free.
  std::size_t index(std::uint64_t hash) const {
    std::size_t i = hash & (slots_.size() - 1);
    while (slots_[i].hash != 0 && slots_[i].hash != hash) i = (i + 1) & (slots_.size() - 1);
    return i;
  }
  void grow() {
    std::vector<Slot> before(slots_.empty() ? 16 : 2 * slots_.size());
    before.swap(slots_);
    used_ = 0;
    for (const Slot& slot : before) {
      if (slot.count == 0) continue;
      slots_[index(slot.hash)] = slot;
      ++used_;
    }
  }

  std::vector<Slot> slots_;  ///< Their number is a power of two.
  std::size_t used_ = 0;     ///< The number of slots that are not free.
};

}  // namespace tolvol
