// SPDX-License-Identifier: GPL-3.0-or-later
// Draws the edges of a mesh over its faces.
out vec4 colour;

void main() { colour = vec4(0, 0, 0, 0.5); }
