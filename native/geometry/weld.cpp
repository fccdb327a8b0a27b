// SPDX-License-Identifier: GPL-3.0-or-later
// Vertices are distributed to groups by a hash of their position, so that a thread finds the equal ones of a group in a
// table that fits its cache. Within a group vertices stay in their order, and the first of equal ones is the first.
#include "geometry/weld.h"

#include <algorithm>
#include <bit>
#include <type_traits>

#include "base/call.h"
#include "base/default_init.h"
#include "base/distribute.h"

namespace tolvol {
namespace {

constexpr std::size_t kOfGroup = 4096;  // A group has about this many vertices.

struct Item {
  std::uint32_t hash, vertex;
};

template <class Real>
std::uint32_t hash_of(const glm::vec<3, Real>& p) {
  using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
  std::uint64_t h = 0;
  // A product's bit depends on the bits below it alone. The shifts bring the others down.
  const auto mix = [&](std::uint64_t bits) {
    h ^= bits;
    h *= 0x9E3779B97F4A7C15u;
    h ^= h >> 32;
  };
  for (int k = 0; k < 3; ++k) mix(std::bit_cast<Bits>(p[k] + Real(0)));  // -0 + 0 is 0: equal numbers hash alike
  mix(0);
  return static_cast<std::uint32_t>(h >> 32);
}

/// Sets the representatives of the vertices of a group. The hashes of its items differ in their lowest bits, because
/// the highest ones have chosen the group.
template <class Real>
void weld_group(std::span<const Item> items, std::span<const glm::vec<3, Real>> vertices,
                std::vector<std::uint32_t>& representative) {
  // The table uses open addressing and is at most half full.
  constexpr std::uint32_t kFree = 0xFFFFFFFFu;
  std::vector<std::uint32_t> first(std::bit_ceil(2 * items.size() + 1), kFree);
  std::size_t looked_at = 0;
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    poll_at(++looked_at);
    const Item& item = items[i];
    const glm::vec<3, Real>& position = vertices[item.vertex];
    if (position != position) {  // What is no number equals nothing, and would fill the table.
      representative[item.vertex] = item.vertex;
      continue;
    }
    std::size_t place = item.hash & (first.size() - 1);
    const auto differs = [&](const Item& other) {
      return other.hash != item.hash || vertices[other.vertex] != position;
    };
    for (; first[place] != kFree && differs(items[first[place]]); place = (place + 1) & (first.size() - 1)) {
      poll_at(++looked_at);
    }
    if (first[place] == kFree) first[place] = i;
    representative[item.vertex] = items[first[place]].vertex;
  }
}

template <class Real>
std::vector<std::uint32_t> weld(std::span<const glm::vec<3, Real>> vertices, Team& team) {
  const std::size_t count = vertices.size();
  const std::size_t groups = std::bit_ceil(1 + count / kOfGroup);
  const int bits = std::countr_zero(groups);
  const auto group_of = [&](std::uint32_t hash) { return std::uint64_t(hash) << bits >> 32; };
  Unfilled<std::uint32_t> hashes(count);
  team.run(count, kOfGroup, [&](std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) hashes[i] = hash_of(vertices[i]);
  });
  Unfilled<Item> items(count);
  const std::vector<std::uint32_t> begin = distribute(
      count, groups, team, [&](std::size_t i) { return group_of(hashes[i]); },
      [&](std::size_t i, std::uint32_t at) {
        items[at] = {hashes[i], std::uint32_t(i)};
      });
  std::vector<std::uint32_t> representative;
  fill(representative, count, 0u);
  team.run(groups, 1, [&](std::size_t group, std::size_t) {
    weld_group<Real>({items.data() + begin[group], items.data() + begin[group + 1]}, vertices, representative);
  });
  return representative;
}

}  // namespace

std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::dvec3> vertices, Team& team) {
  return weld(vertices, team);
}

std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::vec3> vertices, Team& team) {
  return weld(vertices, team);
}

std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::dvec3> vertices) {
  Team alone(1);
  return weld(vertices, alone);
}

}  // namespace tolvol
