// SPDX-License-Identifier: GPL-3.0-or-later
// Discards samples for an occlusion query, which counts the others.
void main() {
  if (!sample_counts()) discard;
}
