// SPDX-License-Identifier: GPL-3.0-or-later
// Distances of triangles at the nodes of a grid, as scatter.cpp computes them. Each work group looks at one block of nodes
// near one triangle. A first pass leaves the smallest distance at each node, and a second the lowest id of the triangles
// that have this distance. Positive floats are ordered like their bits, so that atomicMin() finds the smallest distance as
// well as the lowest id.
layout(local_size_x = 64) in;

// The numbers of a triangle, in the order of scatter_gl.cpp.
layout(std430, binding = 0) readonly buffer Triangles { float triangles[]; };
// The place of a triangle among the numbers, its id, the first node of the block, and the block's numbers of nodes.
layout(std430, binding = 1) readonly buffer Blocks { uint blocks[]; };
layout(std430, binding = 2) coherent buffer Distances { uint distances[]; };
layout(std430, binding = 3) coherent buffer Ids { uint ids[]; };

uniform ivec3 nodes;
uniform int pitch;
uniform float spacing;
uniform float band;
uniform int finds_ids;  // 0 in the first pass and 1 in the second

vec3 vector_at(uint i) { return vec3(triangles[i], triangles[i + 1], triangles[i + 2]); }

// The squared distance of p from the edge from the origin to e.
float edge_distance2(vec3 p, vec3 e, float inverse) {
  const vec3 d = p - clamp(dot(p, e) * inverse, 0.0, 1.0) * e;
  return dot(d, d);
}

void main() {
  const uint block = 8 * gl_WorkGroupID.x, t = blocks[block], id = blocks[block + 1];
  const uvec3 begin = uvec3(blocks[block + 2], blocks[block + 3], blocks[block + 4]);
  const uvec3 size = uvec3(blocks[block + 5], blocks[block + 6], blocks[block + 7]);
  const vec3 first = vector_at(t), ab = vector_at(t + 3), ac = vector_at(t + 6), bc = vector_at(t + 9);
  const vec3 gs = vector_at(t + 12), gt = vector_at(t + 15), normal = vector_at(t + 18), inverse = vector_at(t + 21);
  const vec3 middle = vector_at(t + 24);
  const float radius = triangles[t + 27];
  const bool has_plane = normal != vec3(0);
  for (uint i = gl_LocalInvocationID.x; i < size.x * size.y * size.z; i += 64) {
    const uvec3 node = begin + uvec3(i % size.x, i / size.x % size.y, i / size.x / size.y);
    const uint place = (node.z * uint(nodes.y) + node.y) * uint(pitch) + node.x;
    const vec3 p = first + vec3(node) * spacing;
    // At nearly all nodes another triangle is nearer than any point of the ball around this one.
    const float reach = uintBitsToFloat(distances[place]) + radius;
    if (dot(p - middle, p - middle) >= reach * reach) continue;
    precise float d2 = min(min(edge_distance2(p, ab, inverse.x), edge_distance2(p, ac, inverse.y)),
                           edge_distance2(p - ab, bc, inverse.z));
    const float s = dot(p, gs), u = dot(p, gt), off = dot(p, normal);
    if (has_plane && s >= 0 && u >= 0 && s + u <= 1) d2 = off * off;
    precise float d = sqrt(d2);
    if (!(d < band)) continue;
    if (finds_ids == 0) {
      atomicMin(distances[place], floatBitsToUint(d));
    } else if (floatBitsToUint(d) == distances[place]) {
      atomicMin(ids[place], id);
    }
  }
}
