// SPDX-License-Identifier: GPL-3.0-or-later
/// Tells whether the sample of this pixel is inside. A pixel that stands for no sample is not.
uniform sampler3D distances;  // in frame lengths, never too small
uniform float bound;          // upper bound of the interpolated distance
uniform float bound_near;     // upper bound of the distance at a node plus the way to it
uniform float spacing2;       // squared grid spacing, in frame lengths
uniform int cell;
uniform int around = 8;       // number of nodes; it is not a constant, because an unrolled loop is not left early

bool sample_counts() {
  const vec2 pixel = vec2(ivec2(gl_FragCoord.xy) & (cell - 1));
  if (pixel.x + pixel.y > uintBitsToFloat(corner_n.w)) return false;
  precise const vec3 point = uintBitsToFloat(corner_n.xyz) + (pixel.x * uintBitsToFloat(edge1_counter.xyz) +
                                                              pixel.y * uintBitsToFloat(edge2_unused.xyz));
  // The distance at the point is at most the distance at a node plus the way to it. Well inside the tolerance one node is
  // often enough. The nearest node comes first.
  const ivec3 low = ivec3(point), first = ivec3(point + 0.5) - low;
  precise float interpolated = 0;
  for (int k = 0; k < around; ++k) {
    const ivec3 node = low + (first ^ ivec3(k & 1, (k >> 1) & 1, k >> 2));
    const float d = texelFetch(distances, node, 0).r;
    precise const vec3 way = point - vec3(node), weight = 1 - abs(way);
    precise const float room = bound_near - d, room2 = room * room;
    precise const float way2 = spacing2 * (way.x * way.x + way.y * way.y + way.z * way.z);
    if (room > 0 && way2 <= room2) return true;
    interpolated += weight.x * weight.y * weight.z * d;
  }
  return interpolated <= bound;
}
