// SPDX-License-Identifier: GPL-3.0-or-later
// Signed distance of a place from the nearest triangle of a reference, found in a tree of boxes: exact but for rounding,
// which is taken off. What is closer than that has the distance 0.

// ROW: the width of both textures.
vec4 texel(sampler2D rows, int index) { return texelFetch(rows, ivec2(index % ROW, index / ROW), 0); }

float squared(vec3 v) { return dot(v, v); }

// Of a point p from the line between a and a + ab.
float squared_from_edge(vec3 ap, vec3 ab) {
  return squared(ap - ab * clamp(dot(ab, ap) / max(squared(ab), 1e-30), 0.0, 1.0));
}

// Of a place from the box of node i, squared.
float squared_from_box(sampler2D nodes, int i, vec3 place) {
  return squared(max(max(texel(nodes, 2 * i).xyz - place, place - texel(nodes, 2 * i + 1).xyz), vec3(0.0)));
}

// Of a place from triangle t; `across`: above its plane.
float from_triangle(sampler2D corners, int t, vec3 place, out float across) {
  vec3 a = texel(corners, 3 * t).xyz, b = texel(corners, 3 * t + 1).xyz, c = texel(corners, 3 * t + 2).xyz;
  vec3 ab = b - a, bc = c - b, ca = a - c, ap = place - a, bp = place - b, cp = place - c, normal = cross(ca, ab);
  across = dot(ap, normal) / max(length(normal), 1e-30);
  // Above the face it is its plane that is near, else one of its edges; a needle's plane is known less well.
  bool above = min(min(dot(cross(normal, ab), ap), dot(cross(normal, bc), bp)), dot(cross(normal, ca), cp)) > 0.0;
  float edges = sqrt(min(min(squared_from_edge(ap, ab), squared_from_edge(bp, bc)), squared_from_edge(cp, ca)));
  return above ? min(edges, abs(across)) : edges;
}

// nodes: two texels a node, its box, with the first of its triangles and the one after the last in w; the halves of node
// i are 2 i and 2 i + 1, the root is 1, `leaves` is the first leaf. corners: three texels a triangle, fronts outside.
// Where the reference is farther than `reach`, that is the distance.
float surface_distance(sampler2D nodes, sampler2D corners, int leaves, vec3 place, float reach, float rounding) {
  const float tie = 2e-6;
  float found = reach, steepest = 0.0, side = 1.0, across;
  int i = 1;
  if (squared_from_box(nodes, i, place) > reach * reach) return reach;
  // The triangles in the nearer half of the nearer half are near: a bound to begin with, whatever the reach.
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
        // Of two faces at an edge that it is equally far from, the one that it is more above tells the side.
        if (!(away < found + tie) || (away > found - tie && abs(across) < steepest)) continue;
        found = min(away, found);
        steepest = abs(across);
        side = across < 0.0 ? -1.0 : 1.0;
      }
    }
    // The next part that is not within this one: up as long as this is the second half, then to the other half.
    for (++i; i % 2 == 0; i /= 2) {
    }
  } while (i != 1);
  return side * max(found - rounding, 0.0);
}
