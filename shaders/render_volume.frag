// SPDX-License-Identifier: GPL-3.0-or-later
// Draws a tolerance volume as a translucent shell [Botsch04, Fig. 1], in front of a surface or of the background. On each
// ray from the eye to `place`, the part within the volume absorbs light, and the point of entry reflects some. Where a
// plane cuts the volume open, the section shows distances.
layout(binding = 0) uniform sampler3D field;
layout(binding = 1) uniform sampler1D transfer;
layout(binding = 2) uniform sampler3D far;
uniform float far_spacing, tolerance;  // in grid spacings
uniform vec3 eye;                      // in nodes
uniform vec4 cut;                      // the part of the volume above this plane is cut away; zero cuts nothing
uniform bool surface;                  // whether there is a surface at `place`
in vec3 place;
out vec4 colour;  // multiplied by alpha

const vec3 kClay = vec3(0.93, 0.90, 0.86), kShell = vec3(0.16, 0.52, 0.78);
const float kAbsorption = 0.4;  // exponent of the absorption along a path as long as the tolerance

void main() {
  const vec3 ray = place - eye;
  const float reach = length(ray);
  const vec3 direction = ray / reach;
  colour = vec4(0);
  if (surface) colour = vec4(kClay * head_light(cross(dFdx(place), dFdy(place)), direction), 1);

  const vec3 last = vec3(textureSize(field, 0) - 1);
  const vec2 range = clip_ray(eye, direction, vec2(0, reach), last, cut);
  if (range.x >= range.y) return;
  const Passage passage = march(field, far, far_spacing, eye, direction, range.x, range.y, tolerance);
  if (passage.entry < 0) return;
  const vec3 entry = eye + passage.entry * direction;
  if (passage.entry == range.x && abs(dot(cut, vec4(entry, 1))) < 0.01) {
    colour = vec4(distance_colour(transfer, signed_distance(field, entry) / tolerance, -1), 1);
    return;
  }
  const vec2 e = vec2(0.5, 0);
  const vec3 gradient = vec3(
      abs(signed_distance(field, entry + e.xyy)) - abs(signed_distance(field, entry - e.xyy)),
      abs(signed_distance(field, entry + e.yxy)) - abs(signed_distance(field, entry - e.yxy)),
      abs(signed_distance(field, entry + e.yyx)) - abs(signed_distance(field, entry - e.yyx)));
  const float facing = clamp(abs(dot(normalize(gradient + 1e-6), direction)), 0.0, 1.0);
  const float rim = pow(1 - facing, 3.0);
  const float alpha = 1 - exp(-kAbsorption * passage.inside / tolerance) * (1 - 0.7 * rim);
  const vec3 shell = kShell * mix(0.55, 1.0, facing) + 0.35 * pow(facing, 40.0);
  colour = vec4(shell * alpha, alpha) + (1 - alpha) * colour;
}
