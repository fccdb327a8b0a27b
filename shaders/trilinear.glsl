// SPDX-License-Identifier: GPL-3.0-or-later
/// Interpolates between the eight nodes around `position`, in grid spacings from node (0, 0, 0), which must be at least
/// one rounding away from the border. All terms are products of non-negative factors when the nodes are: the rounding is
/// then relative. Hardware filters are not used: they have few bits.
float trilinear(sampler3D nodes, vec3 position) {
  const ivec3 node = ivec3(position);
  const vec3 t = position - vec3(node), s = 1 - t;
  precise const float y0z0 = s.x * texelFetch(nodes, node, 0).r + t.x * texelFetch(nodes, node + ivec3(1, 0, 0), 0).r;
  precise const float y1z0 =
      s.x * texelFetch(nodes, node + ivec3(0, 1, 0), 0).r + t.x * texelFetch(nodes, node + ivec3(1, 1, 0), 0).r;
  precise const float y0z1 =
      s.x * texelFetch(nodes, node + ivec3(0, 0, 1), 0).r + t.x * texelFetch(nodes, node + ivec3(1, 0, 1), 0).r;
  precise const float y1z1 =
      s.x * texelFetch(nodes, node + ivec3(0, 1, 1), 0).r + t.x * texelFetch(nodes, node + ivec3(1, 1, 1), 0).r;
  precise const float result = s.z * (s.y * y0z0 + t.y * y1z0) + t.z * (s.y * y0z1 + t.y * y1z1);
  return result;
}
