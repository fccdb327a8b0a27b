// SPDX-License-Identifier: GPL-3.0-or-later
// Functions without side effects that compute upper bounds of the distance of a point to a triangle. Each bound is the
// distance to an explicit point of the triangle, the witness. Points of the edges are tried as well as the foot of the
// perpendicular, so that needles and degenerate triangles lose nothing. Rounding changes the parameters of the witness, but
// it remains a point of the triangle. All computations of the bound are `precise`; native/check/gl_certificate.h derives
// the remaining error from the promises of GLSL.

struct WitnessTriangle {
  vec3 ab, ac, bc;
  vec3 gs, gt;   // gradients of the barycentric coordinates of b and c
  vec3 inverse;  // inverse squared lengths of ab, ac, bc
};

float squared_length(vec3 v) {
  precise float sum = v.x * v.x + v.y * v.y + v.z * v.z;
  return sum;
}

WitnessTriangle witness_triangle(vec3 ab, vec3 ac) {
  const float tiny = 1e-30;  // replaces 0, so that no division leaves the range of float
  precise vec3 bc = ac - ab;
  const vec3 n = cross(ab, ac);
  const float inverse = 1 / max(squared_length(n), tiny);
  WitnessTriangle t;
  t.ab = ab, t.ac = ac, t.bc = bc;
  t.gs = cross(ac, n) * inverse, t.gt = cross(n, ab) * inverse;
  t.inverse = 1 / max(vec3(squared_length(ab), squared_length(ac), squared_length(bc)), vec3(tiny));
  return t;
}

// Returns the squared distance of x from the segment from the origin to `edge`.
float squared_distance_to_segment(vec3 x, vec3 edge, float inverse) {
  precise float w = clamp(dot(x, edge) * inverse, 0.0, 1.0);
  precise vec3 rest = x - w * edge;
  return squared_length(rest);
}

// x: the point relative to the triangle's first corner.
float squared_distance_to_witness(vec3 x, WitnessTriangle t) {
  precise vec3 from_b = x - t.ab;
  const float to_edges = min(min(squared_distance_to_segment(x, t.ab, t.inverse.x),
                                 squared_distance_to_segment(x, t.ac, t.inverse.y)),
                             squared_distance_to_segment(from_b, t.bc, t.inverse.z));
  precise float s = dot(x, t.gs), u = dot(x, t.gt), sum = s + u;
  precise vec3 rest = x - s * t.ab - u * t.ac;
  return s >= 0 && u >= 0 && sum <= 1 ? min(to_edges, squared_length(rest)) : to_edges;
}
