// SPDX-License-Identifier: GPL-3.0-or-later
/// Tells whether this pixel violates the bound, with the interpolation of the hardware [Botsch04, §4].
uniform sampler3D distances;  // normalised
uniform vec3 nodes;
uniform float scale, offset;  // they map a texel to a distance in frame lengths
uniform float bound;

bool sample_counts() {
  const float d = texture(distances, (position + 0.5) / nodes).r * scale + offset;
  return abs(d) > bound;
}
