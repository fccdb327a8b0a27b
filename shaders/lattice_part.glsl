// SPDX-License-Identifier: GPL-3.0-or-later
// The inputs of a fragment shader from lattice.vert, which explains them.
flat in uvec4 corner_n;
flat in uvec4 edge1_slot;
flat in uvec4 edge2_unused;
in vec3 position;
