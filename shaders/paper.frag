// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether this pixel violates the bound, by the hardware's own interpolation [Botsch04, §4].
uniform sampler3D distances;  // normalised
uniform vec3 nodes;
uniform float scale, offset;  // frame length of a texel
uniform float bound;
in vec3 position;

bool sample_counts() {
  const float d = texture(distances, (position + 0.5) / nodes).r * scale + offset;
  return abs(d) > bound;
}
