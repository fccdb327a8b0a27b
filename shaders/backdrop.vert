// SPDX-License-Identifier: GPL-3.0-or-later
// Draws one triangle over the whole picture, behind everything. Its points are the ends of the rays that meet no surface.
uniform vec3 eye, forward, right, above;  // in nodes; right and above span half of the picture at distance 1
uniform float end;
out vec3 place;

void main() {
  const vec2 corner = vec2(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1);
  place = eye + end * (forward + corner.x * right + corner.y * above);
  gl_Position = vec4(corner, 1, 1);
}
