// SPDX-License-Identifier: GPL-3.0-or-later
// Draws candidate triangles so that each pixel is one sample of the candidate. The corners are drawn at (0, 0),
// (n + margin, 0) and (0, n + margin). With a margin of 3/2 the triangle covers exactly the pixel centres
// (i + 1/2, j + 1/2) with i + j <= n, and pixel (i, j) stands for corner + i edge1 + j edge2. With a margin of 0 it is the
// triangle of [Botsch04, §4], which leaves out its own corners. Every candidate is drawn in a square cell of the
// framebuffer. Candidates take the cells in turn.
layout(std430, binding = 0) readonly buffer Triangles { uvec4 triangles[]; };  // corner, n; edge1, counter; edge2, unused
uniform float margin;
uniform int cell;        // pixels along a side of a cell
uniform int cells_log2;  // logarithm of the number of cells along the framebuffer, because integer divisions are slow

// These outputs are flat and packed in few vectors, because a software renderer spends most of its time copying them. They
// are integers, because the bits of an integer might be changed when they are passed as a float.
flat out uvec4 corner_n;    // in grid spacings; n, the subdivisions
flat out uvec4 edge1_counter;  // edges divided by n
flat out uvec4 edge2_unused;
out vec3 position;  // the position that the pixel stands for

void main() {
  const int triangle = gl_VertexID / 3, which = gl_VertexID % 3;
  corner_n = triangles[3 * triangle];
  edge1_counter = triangles[3 * triangle + 1];
  edge2_unused = triangles[3 * triangle + 2];
  const float side = uintBitsToFloat(corner_n.w) + margin;
  const vec2 pixel = vec2(which == 1 ? side : 0, which == 2 ? side : 0);
  position = uintBitsToFloat(corner_n.xyz) + pixel.x * uintBitsToFloat(edge1_counter.xyz) +
             pixel.y * uintBitsToFloat(edge2_unused.xyz);
  const int cells = 1 << cells_log2;
  const vec2 place = vec2(triangle & (cells - 1), (triangle >> cells_log2) & (cells - 1));
  gl_Position = vec4(2 * (place + pixel / cell) / cells - 1, 0, 1);
}
