// SPDX-License-Identifier: GPL-3.0-or-later
// Counts samples in a counter for each piece, where an occlusion query for each would be too many.
layout(std430, binding = 1) buffer Counts { uint counts[]; };

void main() {
  if (sample_counts()) atomicAdd(counts[edge1_counter.w], 1u);
}
