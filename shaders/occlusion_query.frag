// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether the lattice point of this pixel is inside. A pixel that is not of the lattice is not.
uniform sampler3D distances;  // frame lengths, never too small
uniform float bound;
uniform int cell;

bool sample_counts() {
  const vec2 pixel = vec2(ivec2(gl_FragCoord.xy) & (cell - 1));
  precise const vec3 point = uintBitsToFloat(corner_n.xyz) + (pixel.x * uintBitsToFloat(edge1_slot.xyz) +
                                                              pixel.y * uintBitsToFloat(edge2_unused.xyz));
  return pixel.x + pixel.y <= uintBitsToFloat(corner_n.w) && trilinear(distances, point) <= bound;
}
