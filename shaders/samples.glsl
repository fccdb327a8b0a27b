// SPDX-License-Identifier: GPL-3.0-or-later
// What samples.vert hands to fragments, see there.
flat in uvec4 corner_n;
flat in uvec4 edge1_counter;
flat in uvec4 edge2_unused;
in vec3 position;
