// SPDX-License-Identifier: GPL-3.0-or-later
// Follows rays through a tolerance volume, in nodes of its field. This file needs signed_distance.glsl.

struct Passage {
  float entry;   // where the ray first is within the tolerance; negative if nowhere
  float inside;  // length of the ray within the tolerance
};

// Follows the ray from + t * direction (of unit length) from t = `begin` to `end`. `far` holds exact unsigned distances to
// the reference at every `far_spacing` nodes of the same box. They permit long steps far from the reference [J. Hart,
// Sphere tracing, 1996].
Passage march(sampler3D field, sampler3D far, float far_spacing, vec3 from, vec3 direction, float begin, float end,
              float tolerance) {
  const vec3 far_size = vec3(textureSize(far, 0));
  // The interpolated distance is wrong by at most the half diagonal of a cell, and by the rounding of the texture filter.
  const float slack = 0.9 * far_spacing;
  Passage passage = Passage(-1, 0);
  float t = begin, before = 0, last_step = 0;
  for (int i = 0; i < 512 && t < end; ++i) {
    const vec3 place = from + t * direction;
    const float clear = texture(far, (place / far_spacing + 0.5) / far_size).r - slack - tolerance;
    if (clear > 1) {
      t += clear;
      before = 0;
      continue;
    }
    const float d = abs(signed_distance(field, place)) - tolerance;
    const float step = max(0.9 * abs(d), 0.2);  // at least a fifth of a node, which is finer than the field
    if (d < 0) {
      if (passage.entry < 0) passage.entry = before > 0 ? t + last_step * d / (before - d) : t;
      passage.inside += min(step, end - t);
    }
    before = d;
    last_step = step;
    t += step;
  }
  return passage;
}

// Returns the part of a ray that is within the box from 0 to `last` and on the side of a plane where
// dot(plane, (place, 1)) <= 0. If there is no such part, x > y.
vec2 clip_ray(vec3 from, vec3 direction, vec2 range, vec3 last, vec4 plane) {
  const vec3 a = -from / direction, b = (last - from) / direction, near = min(a, b), far = max(a, b);
  range = vec2(max(range.x, max(near.x, max(near.y, near.z))), min(range.y, min(far.x, min(far.y, far.z))));
  const float slope = dot(plane.xyz, direction), height = dot(plane, vec4(from, 1));
  if (slope > 0) range.y = min(range.y, -height / slope);
  if (slope < 0) range.x = max(range.x, -height / slope);
  if (slope == 0 && height > 0) range.y = -1;
  return range;
}
