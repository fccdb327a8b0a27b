// SPDX-License-Identifier: GPL-3.0-or-later
// Functions that map a distance to a colour.

// Looks up the colour of a distance in a table. The distance is in tolerances, from `lowest` to 1. `lowest` is 0 for
// magnitudes and -1 for signed distances.
vec3 distance_colour(sampler1D transfer, float distance_in_tolerances, float lowest) {
  const float d = lowest < 0 ? distance_in_tolerances : abs(distance_in_tolerances);
  const float size = float(textureSize(transfer, 0));
  return texture(transfer, (0.5 + clamp((d - lowest) / (1 - lowest), 0.0, 1.0) * (size - 1)) / size).rgb;
}

// Returns the colour of diagonal stripes, which mark points beyond the tolerance. A stripe is half of `period` wide. `at`
// is in samples of the picture.
vec3 outside_colour(vec2 at, float period, vec3 colour, vec3 stripe) {
  return fract((at.x + at.y) / period) < 0.5 ? colour : stripe;
}

// Returns the brightness by a light beside the eye and an even sky. It is 1 where the surface faces the eye. `normal` may
// have any length. Where the eye sees a triangle from its edge, the length is 0 or overflows: there only the sky gives
// light.
float head_light(vec3 normal, vec3 to_eye) {
  float facing = abs(dot(normal, to_eye)) / length(normal);
  return mix(0.5, 1.0, facing >= 0.0 ? min(facing, 1.0) : 0.0);
}
