// SPDX-License-Identifier: GPL-3.0-or-later
// Computes the signed distance of a place from the nearest triangle of a reference, which is found in a tree of boxes. The
// distance is exact up to rounding. The largest rounding error is subtracted, so a place that is closer has distance 0.

// ROW is the width of both textures.
vec4 texel(sampler2D rows, int index) { return texelFetch(rows, ivec2(index % ROW, index / ROW), 0); }

float squared(vec3 v) { return dot(v, v); }

// Returns the squared distance of a point p from the segment between a and a + ab.
float squared_from_edge(vec3 ap, vec3 ab) {
  return squared(ap - ab * clamp(dot(ab, ap) / max(squared(ab), 1e-30), 0.0, 1.0));
}

// Returns the squared distance of a place from the box of node i.
float squared_from_box(sampler2D nodes, int i, vec3 place) {
  return squared(max(max(texel(nodes, 2 * i).xyz - place, place - texel(nodes, 2 * i + 1).xyz), vec3(0.0)));
}

// Returns the distance of a place from triangle t. `across` is the signed distance from the plane of the triangle.
float from_triangle(sampler2D corners, int t, vec3 place, out float across) {
  vec3 a = texel(corners, 3 * t).xyz, b = texel(corners, 3 * t + 1).xyz, c = texel(corners, 3 * t + 2).xyz;
  vec3 ab = b - a, bc = c - b, ca = a - c, ap = place - a, bp = place - b, cp = place - c, normal = cross(ca, ab);
  across = dot(ap, normal) / max(length(normal), 1e-30);
  // Above the face its plane is the nearest, elsewhere one of its edges. The plane of a needle is less accurate than its
  // edges, so the smaller of the two distances counts.
  bool above = min(min(dot(cross(normal, ab), ap), dot(cross(normal, bc), bp)), dot(cross(normal, ca), cp)) > 0.0;
  float edges = sqrt(min(min(squared_from_edge(ap, ab), squared_from_edge(bp, bc)), squared_from_edge(cp, ca)));
  return above ? min(edges, abs(across)) : edges;
}

// nodes: two texels for each node hold its box, and in w its first triangle and the one after its last. The halves of node
// i are the nodes 2 i and 2 i + 1, the root is node 1, and `leaves` is the first leaf. corners: three texels for each
// triangle, whose front is outside. If the reference is farther away than `reach`, the result is `reach`.
float surface_distance(sampler2D nodes, sampler2D corners, int leaves, vec3 place, float reach, float rounding) {
  const float tie = 2e-6;
  float found = reach, steepest = 0.0, side = 1.0, across;
  int i = 1;
  if (squared_from_box(nodes, i, place) > reach * reach) return reach;
  // Descending to the nearer half at each node leads to a leaf with near triangles. They give a first bound.
  while (i < leaves) {
    i *= 2;
    if (squared_from_box(nodes, i + 1, place) < squared_from_box(nodes, i, place)) ++i;
  }
  for (int t = int(texel(nodes, 2 * i).w); t < int(texel(nodes, 2 * i + 1).w); ++t) {
    found = min(found, from_triangle(corners, t, place, across));
  }
  i = 1;
  do {
    float enough = found + tie;
    if (squared_from_box(nodes, i, place) <= enough * enough) {
      if (i < leaves) {
        i *= 2;
        continue;
      }
      int end = int(texel(nodes, 2 * i + 1).w);
      for (int t = int(texel(nodes, 2 * i).w); t < end; ++t) {
        float away = from_triangle(corners, t, place, across);
        // If the place is equally far from two faces at an edge, the face with the larger distance from its plane tells the
        // side.
        if (!(away < found + tie) || (away > found - tie && abs(across) < steepest)) continue;
        found = min(away, found);
        steepest = abs(across);
        side = across < 0.0 ? -1.0 : 1.0;
      }
    }
    // Go to the next node that is not within this one: up while this is the second half, then to the other half.
    for (++i; i % 2 == 0; i /= 2) {
    }
  } while (i != 1);
  return side * max(found - rounding, 0.0);
}
