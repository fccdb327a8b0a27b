// SPDX-License-Identifier: GPL-3.0-or-later
// Draws a mesh whose vertices are given in nodes of a distance field.
layout(location = 0) in vec3 vertex;
uniform mat4 to_clip;
out vec3 place;
invariant gl_Position;

void main() {
  place = vertex;
  gl_Position = to_clip * vec4(vertex, 1);
}
