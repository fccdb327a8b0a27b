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

/// A hash table with open addressing, which is several times as fast as std::unordered_map: every collapse asks it. A
/// slot has 48 bits of a hash and 16 bits that count. Two places with the same 48 bits, by chance one pair in 2^48,
/// only cost a vertex a free place. So does a place at which 65,535 vertices were at once: it stays occupied.
class Occupied {
 public:
  void add(const glm::dvec3& place) {
    if (2 * (used_ + 1) > slots_.size()) grow();
    std::uint64_t& slot = slots_[index(tag(place))];
    used_ += slot == 0;
    slot |= tag(place);
    slot += !is_full(slot);
  }
  /// Takes back one add(). The place was added.
  void remove(const glm::dvec3& place) {
    std::uint64_t& slot = slots_[index(tag(place))];
    slot -= !is_full(slot);
  }
  bool contains(const glm::dvec3& place) const { return !slots_.empty() && count(slots_[index(tag(place))]) > 0; }

 private:
  static constexpr std::uint64_t kFull = 0xFFFF;
  static constexpr int kCountBits = 16;

  static std::uint64_t count(std::uint64_t slot) { return slot & kFull; }
  static bool is_full(std::uint64_t slot) { return count(slot) == kFull; }
  static std::uint64_t tag_of(std::uint64_t slot) { return slot & ~kFull; }

  /// The bits of a slot that are the hash. They are not 0, which is the value of a free slot.
  static std::uint64_t tag(const glm::dvec3& p) {
    std::uint64_t all = 0;
    for (int k = 0; k < 3; ++k) {  // by the finaliser of SplitMix64
      // The sum with 0.0 turns the negative zero into the positive one, which is equal to it.
      all = (all ^ std::bit_cast<std::uint64_t>(p[k] + 0.0)) + 0x9E3779B97F4A7C15u;
      all = (all ^ (all >> 30)) * 0xBF58476D1CE4E5B9u;
      all = (all ^ (all >> 27)) * 0x94D049BB133111EBu;
      all ^= all >> 31;
    }
    return tag_of(all) == 0 ? kFull + 1 : tag_of(all);
  }
  /// Returns which slot has the tag, or the free one where it belongs. At least half of the slots are free.
  std::size_t index(std::uint64_t tag) const {
    const std::size_t last = slots_.size() - 1;
    std::size_t i = (tag >> kCountBits) & last;
    while (slots_[i] != 0 && tag_of(slots_[i]) != tag) i = (i + 1) & last;
    return i;
  }
  void grow() {
    std::vector<std::uint64_t> before(slots_.empty() ? 16 : 2 * slots_.size());
    before.swap(slots_);
    used_ = 0;
    for (const std::uint64_t slot : before) {
      if (count(slot) == 0) continue;
      slots_[index(tag_of(slot))] = slot;
      ++used_;
    }
  }

  std::vector<std::uint64_t> slots_;  ///< Their number is a power of two.
  std::size_t used_ = 0;              ///< The number of slots that are not free.
};

}  // namespace tolvol
