// SPDX-License-Identifier: GPL-3.0-or-later
// The witness certificate. Each invocation decides one candidate. A part of the candidate is inside if all three of its
// corners have a witness in the same reference triangle. The triangles of the nodes around the part's centre are tried;
// if none of them proves the part, the part is split. This file needs split.glsl and witness.glsl.
layout(local_size_x = 64) in;

layout(std430, binding = 0) readonly buffer Candidates { float corners[]; };  // nine numbers for each candidate
layout(std430, binding = 1) readonly buffer Open { uint open_candidates[]; };
layout(std430, binding = 2) writeonly buffer Proved { uint proved[]; };  // 1 for a proved candidate; 0 is never written
layout(std430, binding = 3) readonly buffer Nodes { uint closest[]; };   // the grid's triangles
layout(std430, binding = 4) readonly buffer ReferenceA { float reference_a[]; };
layout(std430, binding = 5) readonly buffer ReferenceAb { float reference_ab[]; };
layout(std430, binding = 6) readonly buffer ReferenceAc { float reference_ac[]; };

uniform uint open_count;
uniform vec3 origin;  // the origin of the grid
uniform float spacing;
uniform ivec3 nodes;
uniform int pitch;
uniform float limit2;  // the squared distance up to which a witness proves
uniform float shortest;  // a part this short is not split further
uniform int tries;       // number of nodes whose triangle is tried, 1 to 8, the nearest first
uniform int budget;      // the most parts that are looked at

const uint kNone = 0xFFFFFFFFu;

// Returns the closest triangle of a node, or kNone outside the grid.
uint triangle_at(ivec3 node) {
  if (any(lessThan(node, ivec3(0))) || any(greaterThanEqual(node, nodes))) return kNone;
  return closest[(uint(node.z) * uint(nodes.y) + uint(node.y)) * uint(pitch) + uint(node.x)];
}

bool covers(uint triangle, mat3 part) {
  const uint i = 3 * triangle;
  const vec3 a = vec3(reference_a[i], reference_a[i + 1], reference_a[i + 2]);
  const WitnessTriangle t =
      witness_triangle(vec3(reference_ab[i], reference_ab[i + 1], reference_ab[i + 2]),
                       vec3(reference_ac[i], reference_ac[i + 1], reference_ac[i + 2]));
  for (int corner = 0; corner < 3; ++corner) {
    precise vec3 x = part[corner] - a;
    if (!(squared_distance_to_witness(x, t) <= limit2)) return false;
  }
  return true;
}

// `known`: whether any of the nodes that were tried names a triangle.
bool is_covered(mat3 part, out bool known) {
  const vec3 cell = ((part[0] + part[1] + part[2]) / 3 - origin) / spacing, low = floor(cell);
  const ivec3 nearest = ivec3(greaterThan(cell - low, vec3(0.5)));
  uint last = kNone;
  known = false;
  for (int i = 0; i < tries; ++i) {
    const uint triangle = triangle_at(ivec3(low) + (nearest ^ (ivec3(i, i >> 1, i >> 2) & 1)));
    if (triangle == kNone || triangle == last) continue;
    if (covers(triangle, part)) return true;
    known = true, last = triangle;
  }
  return false;
}

float longest_edge(mat3 t) { return max(max(distance(t[0], t[1]), distance(t[1], t[2])), distance(t[2], t[0])); }

bool is_inside(mat3 candidate) {
  const float halvings = ceil(log2(max(longest_edge(candidate) / shortest, 1.0)));
  const int deepest = int(min(halvings, float(kDeepest)));
  Part part = Part(0, 0);
  for (int looked = 0; looked < budget; ++looked) {
    const mat3 w = weights(part);
    precise mat3 corners_of_part;
    for (int corner = 0; corner < 3; ++corner) {
      corners_of_part[corner] =
          candidate[0] * w[corner].x + candidate[1] * w[corner].y + candidate[2] * w[corner].z;
    }
    bool known;
    if (is_covered(corners_of_part, known)) {
      part = next_after(part);
      if (part.depth == 0) return true;
    } else {
      if (!known || part.depth == deepest) return false;
      part = first_within(part);
    }
  }
  return false;
}

void main() {
  if (gl_GlobalInvocationID.x >= open_count) return;
  const uint candidate = open_candidates[gl_GlobalInvocationID.x], i = 9 * candidate;
  if (is_inside(mat3(corners[i], corners[i + 1], corners[i + 2], corners[i + 3], corners[i + 4], corners[i + 5],
                     corners[i + 6], corners[i + 7], corners[i + 8]))) {
    proved[candidate] = 1;
  }
}
