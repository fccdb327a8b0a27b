// SPDX-License-Identifier: GPL-3.0-or-later
// The inputs of a fragment shader from samples.vert, which explains them.
flat in uvec4 corner_n;
flat in uvec4 edge1_counter;
flat in uvec4 edge2_unused;
in vec3 position;
