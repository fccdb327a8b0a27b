// SPDX-License-Identifier: GPL-3.0-or-later
// One counter a slot, where a query each would be too many.
layout(std430, binding = 1) buffer Counts { uint counts[]; };
flat in uint slot;

void main() {
  if (sample_counts()) atomicAdd(counts[slot], 1u);
}
