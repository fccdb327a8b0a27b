// SPDX-License-Identifier: GPL-3.0-or-later
// From a distance to a colour.

// Looks a distance between `lowest` and 1 tolerances up in a table of colours; 0: its magnitude, -1: with its sign.
vec3 distance_colour(sampler1D transfer, float distance_in_tolerances, float lowest) {
  const float d = lowest < 0 ? distance_in_tolerances : abs(distance_in_tolerances);
  const float size = float(textureSize(transfer, 0));
  return texture(transfer, (0.5 + clamp((d - lowest) / (1 - lowest), 0, 1) * (size - 1)) / size).rgb;
}

// Diagonal stripes as wide as half of `period`, for what is out of tolerance; `at` in samples of the picture.
vec3 outside_colour(vec2 at, float period, vec3 colour, vec3 stripe) {
  return fract((at.x + at.y) / period) < 0.5 ? colour : stripe;
}

// A light beside the eye and an even sky; 1 where the surface faces the eye.
float head_light(vec3 normal, vec3 to_eye) { return mix(0.5, 1, abs(dot(normal, to_eye))); }
