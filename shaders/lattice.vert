// SPDX-License-Identifier: GPL-3.0-or-later
// Draws candidate triangles so that each pixel is one point of a lattice on the candidate: corners at (0, 0),
// (n + margin, 0) and (0, n + margin). With a margin of 3/2 they cover exactly the pixel centres (i + 1/2, j + 1/2) with
// i + j <= n, and pixel (i, j) stands for corner + i edge1 + j edge2. With none they are the triangle of [Botsch04, §4],
// which leaves out its own corners. Every candidate has a square cell of the framebuffer; they take turns.
layout(std430, binding = 0) readonly buffer Parts { vec4 parts[]; };  // corner, n; edge1, slot; edge2, unused
uniform float margin;
uniform int cell, cells;  // pixels along a cell, cells along the framebuffer

flat out vec3 corner, edge1, edge2;  // in grid spacings; edges divided by n
flat out float subdivisions;
flat out uint slot;
out vec3 position;  // of the pixel's centre

void main() {
  const int part = gl_VertexID / 3, which = gl_VertexID % 3;
  const vec4 first = parts[3 * part], second = parts[3 * part + 1];
  corner = first.xyz;
  edge1 = second.xyz;
  edge2 = parts[3 * part + 2].xyz;
  subdivisions = first.w;
  slot = floatBitsToUint(second.w);
  const float side = subdivisions + margin;
  const vec2 pixel = vec2(which == 1 ? side : 0, which == 2 ? side : 0);
  position = corner + pixel.x * edge1 + pixel.y * edge2;
  const vec2 place = vec2(part % cells, part / cells % cells);
  gl_Position = vec4(2 * (place + pixel / cell) / cells - 1, 0, 1);
}
