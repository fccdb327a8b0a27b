// SPDX-License-Identifier: GPL-3.0-or-later
// Draws candidate triangles so that each pixel is one point of a lattice on the candidate: corners at (0, 0),
// (n + 3/2, 0) and (0, n + 3/2) cover exactly the pixel centres (i + 1/2, j + 1/2) with i + j <= n, and pixel (i, j)
// stands for corner 0 + i/n (corner 1 - corner 0) + j/n (corner 2 - corner 0). After [Botsch04, §4], whose triangle of
// edge n leaves out its own corners.
layout(std430, binding = 0) readonly buffer Points { float points[]; };        // x, y, z
layout(std430, binding = 1) readonly buffer Corners { uint corners[]; };       // three a candidate
layout(std430, binding = 2) readonly buffer Subdivisions { uint lattice[]; };  // n, at least 1
uniform vec2 framebuffer;  // its size in pixels

flat out vec3 corner0, edge1, edge2;  // edges divided by n
flat out uint candidate;

vec3 point(uint i) { return vec3(points[3 * i], points[3 * i + 1], points[3 * i + 2]); }

void main() {
  candidate = uint(gl_VertexID) / 3;
  const uint corner = uint(gl_VertexID) % 3;
  const float n = float(lattice[candidate]);
  corner0 = point(corners[3 * candidate]);
  edge1 = (point(corners[3 * candidate + 1]) - corner0) / n;
  edge2 = (point(corners[3 * candidate + 2]) - corner0) / n;
  const vec2 pixel = corner == 1 ? vec2(n + 1.5, 0) : corner == 2 ? vec2(0, n + 1.5) : vec2(0);
  gl_Position = vec4(2 * pixel / framebuffer - 1, 0, 1);
}
