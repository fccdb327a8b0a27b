// SPDX-License-Identifier: GPL-3.0-or-later
// Counts samples in one counter for each piece: an occlusion query for each piece would be too many queries.
layout(std430, binding = 1) buffer Counts { uint counts[]; };

void main() {
  if (sample_counts()) atomicAdd(counts[edge1_counter.w], 1u);
}
