// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether the lattice point of this pixel is inside. A pixel that is not of the lattice is not.
uniform sampler3D distances;  // frame lengths, never too small
uniform float bound;
uniform int cell;
flat in vec3 corner, edge1, edge2;
flat in float subdivisions;

bool sample_counts() {
  const vec2 pixel = vec2(ivec2(gl_FragCoord.xy) & (cell - 1));
  precise const vec3 position = corner + (pixel.x * edge1 + pixel.y * edge2);
  return pixel.x + pixel.y <= subdivisions && trilinear(distances, position) <= bound;
}
