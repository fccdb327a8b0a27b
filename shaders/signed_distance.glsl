// SPDX-License-Identifier: GPL-3.0-or-later
// Returns the signed distance, in grid spacings, at a place given in nodes: the trilinear interpolation of the eight nodes
// around the place. The field is in spacings too. A place outside the field has the value of the nearest place inside.
// True distances of neighbouring nodes differ by at most 1, and their signs differ only if the surface lies between them.
// If the values of neighbouring nodes differ by more than 1, their sign changes without a surface between them (for
// example, beyond the border of an open mesh), and interpolation would show a surface there. In this case the distance is
// interpolated without signs, and gets the sign of the nearest node.
float signed_distance(sampler3D field, vec3 place) {
  const vec3 last = vec3(textureSize(field, 0) - 1);
  place = clamp(place, vec3(0), last);
  const vec3 first = min(floor(place), last - 1);
  const ivec3 cell = ivec3(first);
  const vec3 t = place - first;
  // The four components are for (y, z) = (0, 0), (1, 0), (0, 1), (1, 1).
  vec4 low = vec4(texelFetch(field, cell, 0).r, texelFetch(field, cell + ivec3(0, 1, 0), 0).r,
                  texelFetch(field, cell + ivec3(0, 0, 1), 0).r, texelFetch(field, cell + ivec3(0, 1, 1), 0).r);
  vec4 high = vec4(texelFetch(field, cell + ivec3(1, 0, 0), 0).r, texelFetch(field, cell + ivec3(1, 1, 0), 0).r,
                   texelFetch(field, cell + ivec3(1, 0, 1), 0).r, texelFetch(field, cell + ivec3(1, 1, 1), 0).r);
  const vec4 change = max(abs(high - low), max(abs(low.xxyz - low.yzww), abs(high.xxyz - high.yzww)));
  const float steepest = max(max(change.x, change.y), max(change.z, change.w));
  float sign_of_nearest = 1;
  if (steepest > 1.001) {  // 0.001 is for rounding
    const vec4 side = t.x < 0.5 ? low : high;
    const vec2 row = t.z < 0.5 ? side.xy : side.zw;
    sign_of_nearest = sign(t.y < 0.5 ? row.x : row.y);
    low = abs(low);
    high = abs(high);
  }
  const vec4 along_x = mix(low, high, t.x);
  const vec2 along_y = mix(along_x.xz, along_x.yw, t.y);
  return sign_of_nearest * mix(along_y.x, along_y.y, t.z);
}
