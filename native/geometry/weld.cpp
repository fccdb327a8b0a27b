// SPDX-License-Identifier: GPL-3.0-or-later
// Vertices are distributed to groups by a hash of their position, so that a thread finds the equal ones of a group in a
// table that fits its cache. Within a group vertices stay in their order, and the first of equal ones is the first.
#include "geometry/weld.h"

#include <algorithm>
#include <bit>
#include <type_traits>
#include <utility>

#include "base/default_init.h"
#include "base/parallel.h"

namespace tolvol {
namespace {

constexpr std::size_t kOfGroup = 4096;      // A group has about this many vertices.
constexpr std::size_t kOfThread = 100'000;  // With fewer vertices a thread would cost more time than it saves.

struct Item {
  std::uint32_t hash, vertex;
};

/// All bits depend on all coordinates, the highest ones most.
template <class Real>
std::uint64_t hash_of(const glm::vec<3, Real>& p) {
  using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
  std::uint64_t h = 0;
  for (int k = 0; k < 3; ++k) {
    h ^= h >> 32;
    h ^= std::bit_cast<Bits>(p[k] + Real(0));  // -0 + 0 is 0, so that equal numbers hash alike
    h *= 0x9E3779B97F4A7C15u;
  }
  return h;
}

/// Sets the representatives of the vertices of a group.
template <class Real>
void weld_group(std::span<const Item> items, std::span<const glm::vec<3, Real>> vertices,
                std::vector<std::uint32_t>& representative) {
  // The table uses open addressing and is at most half full.
  constexpr std::uint32_t kFree = 0xFFFFFFFFu;
  std::vector<std::uint32_t> first(std::bit_ceil(2 * items.size() + 1), kFree);
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    poll_at(i);
    const auto [hash, vertex] = items[i];
    std::size_t place = hash & (first.size() - 1);
    const auto differs = [&](const Item& other) {
      return other.hash != hash || vertices[other.vertex] != vertices[vertex];
    };
    while (first[place] != kFree && differs(items[first[place]])) place = (place + 1) & (first.size() - 1);
    if (first[place] == kFree) first[place] = i;
    representative[vertex] = items[first[place]].vertex;
  }
}

template <class Real>
std::vector<std::uint32_t> weld(std::span<const glm::vec<3, Real>> vertices, unsigned threads) {
  const std::size_t count = vertices.size();
  Team team(static_cast<unsigned>(std::min<std::size_t>(thread_count(threads), 1 + count / kOfThread)));
  const std::size_t groups = std::bit_ceil(1 + count / kOfGroup);
  const int bits = std::countr_zero(groups);
  const auto group_of = [&](std::uint64_t hash) { return bits == 0 ? 0 : hash >> (64 - bits); };
  // Each part of the vertices has its own places in each group, so that no two threads write to one place.
  const std::size_t parts = team.size();
  std::vector<std::vector<std::uint32_t>> next(parts, std::vector<std::uint32_t>(groups));
  const auto for_each_hash = [&](auto&& use) {
    team.run(parts, 1, [&](std::size_t part, std::size_t) {
      for (std::size_t i = count * part / parts; i < count * (part + 1) / parts; ++i) {
        poll_at(i);
        const std::uint64_t hash = hash_of(vertices[i]);
        use(next[part][group_of(hash)], Item{std::uint32_t(hash >> 16), std::uint32_t(i)});
      }
    });
  };
  for_each_hash([](std::uint32_t& counted, const Item&) { ++counted; });
  std::uint32_t before = 0;
  std::vector<std::uint32_t> begin(groups + 1);
  for (std::size_t group = 0; group < groups; ++group) {
    begin[group] = before;
    for (auto& of_part : next) before += std::exchange(of_part[group], before);
  }
  begin[groups] = before;
  Unfilled<Item> items(count);
  for_each_hash([&](std::uint32_t& place, const Item& item) { items[place++] = item; });
  std::vector<std::uint32_t> representative(count);
  team.run(groups, 1, [&](std::size_t group, std::size_t) {
    weld_group<Real>({items.data() + begin[group], items.data() + begin[group + 1]}, vertices, representative);
  });
  return representative;
}

}  // namespace

std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::dvec3> vertices, unsigned threads) {
  return weld(vertices, threads);
}

std::vector<std::uint32_t> weld_equal_positions(std::span<const glm::vec3> vertices, unsigned threads) {
  return weld(vertices, threads);
}

}  // namespace tolvol
