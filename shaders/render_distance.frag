// SPDX-License-Identifier: GPL-3.0-or-later
// Colours each pixel of a mesh by its distance to the reference. The distance is interpolated first, then coloured
// [Botsch04, §3].
layout(binding = 0) uniform sampler3D field;
layout(binding = 1) uniform sampler1D transfer;
uniform float tolerance;  // in grid spacings
uniform float lowest;     // lowest distance of the transfer function, in tolerances
uniform vec3 eye;         // in nodes
uniform vec2 first;       // the first sample of this tile, as a sample of the picture
uniform float period;     // period of the stripes, in samples
uniform vec3 outside, stripe;
in vec3 place;
out vec4 colour;

void main() {
  const float d = signed_distance(field, place) / tolerance;
  if (abs(d) > 1) {
    colour = vec4(outside_colour(gl_FragCoord.xy + first, period, outside, stripe), 1);
    return;
  }
  const vec3 normal = cross(dFdx(place), dFdy(place));
  colour = vec4(head_light(normal, normalize(eye - place)) * distance_colour(transfer, d, lowest), 1);
}
