// SPDX-License-Identifier: GPL-3.0-or-later
// For an occlusion query, which counts what is not discarded.
void main() {
  if (!sample_counts()) discard;
}
