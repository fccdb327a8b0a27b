// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/morton_order.h"

#include <algorithm>

#include "base/distribute.h"

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
  Unfilled<MortonKey> sorted(keys.size());
  for (int shift = 0; shift < 63; shift += kBits) {
    distribute(
        keys.size(), kDigits, team, [&](std::size_t i) { return keys[i].code >> shift & (kDigits - 1); },
        [&](std::size_t i, std::uint32_t at) { sorted[at] = keys[i]; });
    keys.swap(sorted);
  }
}

}  // namespace tolvol
