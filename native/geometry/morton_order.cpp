// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/morton_order.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace tolvol {
namespace {

/// Returns the lowest 21 bits of x with two zeros between them.
std::uint64_t spread_bits(std::uint64_t x) {
  x &= 0x1FFFFF;
  x = (x | x << 32) & 0x1F00000000FFFF;
  x = (x | x << 16) & 0x1F0000FF0000FF;
  x = (x | x << 8) & 0x100F00F00F00F00F;
  x = (x | x << 4) & 0x10C30C30C30C30C3;
  return (x | x << 2) & 0x1249249249249249;
}

}  // namespace

std::uint64_t morton_code(const glm::dvec3& p) {
  std::uint64_t code = 0;
  for (int k = 0; k < 3; ++k) {
    const double cell = (p[k] + 1) * 0x1p20;
    code |= spread_bits(std::uint64_t(std::clamp(cell, 0.0, double(0x1FFFFF)))) << k;
  }
  return code;
}

// A radix sort, the least significant digit first.
void sort_by_code(Unfilled<MortonKey>& keys, Team& team) {
  constexpr int kBits = 11, kDigits = 1 << kBits;
  // Each part of the keys has its own places for each digit, so that no two threads write to one place.
  const std::size_t parts = team.size();
  const auto first_of = [&](std::size_t part) { return keys.size() * part / parts; };
  std::vector<std::array<std::uint32_t, kDigits>> next(parts);
  Unfilled<MortonKey> sorted(keys.size());
  for (int shift = 0; shift < 63; shift += kBits) {
    const auto digit = [&](const MortonKey& key) { return key.code >> shift & (kDigits - 1); };
    team.run(parts, 1, [&](std::size_t part, std::size_t) {
      next[part].fill(0);
      for (std::size_t i = first_of(part); i < first_of(part + 1); ++i) {
        poll_at(i);
        ++next[part][digit(keys[i])];
      }
    });
    std::uint32_t before = 0;
    for (int d = 0; d < kDigits; ++d) {
      for (auto& of_part : next) before += std::exchange(of_part[d], before);
    }
    team.run(parts, 1, [&](std::size_t part, std::size_t) {
      for (std::size_t i = first_of(part); i < first_of(part + 1); ++i) {
        poll_at(i);
        sorted[next[part][digit(keys[i])]++] = keys[i];
      }
    });
    keys.swap(sorted);
  }
}

}  // namespace tolvol
