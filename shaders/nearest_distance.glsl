// SPDX-License-Identifier: GPL-3.0-or-later
// Signed distance, in grid spacings, at a place given in nodes, from the nearest of the triangles that the eight nodes
// around it are nearest to: for grids too coarse to be interpolated. Never less than the true distance, but for
// rounding, and right unless another triangle is nearer.

vec3 triangle_corner(sampler2D corners, int index) {
  const int width = textureSize(corners, 0).x;
  return texelFetch(corners, ivec2(index % width, index / width), 0).xyz;
}

float squared(vec3 v) { return dot(v, v); }

// Of a point p from the line between a and a + ab.
float squared_from_edge(vec3 ap, vec3 ab) {
  return squared(ap - ab * clamp(dot(ab, ap) / max(squared(ab), 1e-30), 0.0, 1.0));
}

// nearest: the triangle of each node, below 0 where there is none; corners: three texels a triangle, in nodes, fronts
// outside; band: the distance, in spacings, beyond which there is none.
float nearest_distance(sampler3D nearest, sampler2D corners, vec3 place, float band) {
  vec3 last = vec3(textureSize(nearest, 0) - 1);
  place = clamp(place, vec3(0.0), last);
  ivec3 first = ivec3(min(floor(place), last - 1.0));
  float found = band, steepest = 0.0, side = 1.0;
  int before = -1;
  for (int k = 0; k < 8; ++k) {
    int id = int(texelFetch(nearest, first + ivec3(k & 1, (k >> 1) & 1, k >> 2), 0).r);
    if (id < 0 || id == before) continue;
    before = id;
    vec3 a = triangle_corner(corners, 3 * id);
    vec3 b = triangle_corner(corners, 3 * id + 1), c = triangle_corner(corners, 3 * id + 2);
    vec3 ab = b - a, bc = c - b, ca = a - c, ap = place - a, bp = place - b, cp = place - c, normal = cross(ca, ab);
    float across = dot(ap, normal) / max(length(normal), 1e-30);
    // Above the face it is its plane that is near, else one of its edges.
    bool above = min(min(dot(cross(normal, ab), ap), dot(cross(normal, bc), bp)), dot(cross(normal, ca), cp)) > 0.0;
    float edges = min(min(squared_from_edge(ap, ab), squared_from_edge(bp, bc)), squared_from_edge(cp, ca));
    float away = above ? abs(across) : sqrt(edges);
    // Of two faces at an edge that it is equally far from, the one that it is more above tells the side.
    if (!(away < found + 1e-3) || (away > found - 1e-3 && abs(across) < steepest)) continue;
    found = min(away, found);
    steepest = abs(across);
    side = across < 0.0 ? -1.0 : 1.0;
  }
  return side * found;
}
