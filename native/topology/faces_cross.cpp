// SPDX-License-Identifier: GPL-3.0-or-later
// Two triangles that share one corner meet elsewhere exactly if the side of one opposite that corner meets the other
// triangle: their intersection is convex, so it is the corner alone or reaches from it to such a side. Most pairs that
// are asked about are told apart without exact arithmetic, most of the others by the sides of the planes that their
// corners lie on.
#include "topology/faces_cross.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "topology/faces_apart.h"
#include "topology/shared_corners.h"

namespace tolvol {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Points = std::array<Point, 3>;

Points points(const Corners& t) {
  return {Point(t[0].x, t[0].y, t[0].z), Point(t[1].x, t[1].y, t[1].z), Point(t[2].x, t[2].y, t[2].z)};
}

CGAL::Orientation side(const Points& t, const Point& p) { return CGAL::orientation(t[0], t[1], t[2], p); }

/// Turns `t` so that its corner `first` comes first; the orientation stays.
Points turned(const Points& t, int first) { return {t[first], t[(first + 1) % 3], t[(first + 2) % 3]}; }

/// Whether the two triangles on the edge (p, q) overlap: they are in one plane, on one side of the edge.
bool overlap_beside(const Point& p, const Point& q, const Point& a, const Point& b) {
  return CGAL::orientation(p, q, a, b) == CGAL::COPLANAR && CGAL::coplanar_orientation(p, q, a, b) == CGAL::POSITIVE;
}

/// Whether corners 1 and 2 of `b` lie strictly on the same side of the plane of `a`.
bool beside(const Points& a, const Points& b) {
  const CGAL::Orientation one = side(a, b[1]);
  return one != CGAL::COPLANAR && side(a, b[2]) == one;
}

/// For triangles that share their corners 0 and no other.
bool meet_beyond_corner(const Points& a, const Points& b) {
  if (beside(a, b) || beside(b, a)) return false;
  return CGAL::do_intersect(Kernel::Segment_3(a[1], a[2]), Kernel::Triangle_3(b[0], b[1], b[2])) ||
         CGAL::do_intersect(Kernel::Segment_3(b[1], b[2]), Kernel::Triangle_3(a[0], a[1], a[2]));
}

/// Whether a point other than corner 0 of `t`, on the segment from there to `p`, is on the triangle.
bool enters(const Points& t, const Point& p) {
  return p != t[0] && side(t, p) == CGAL::COPLANAR &&
         CGAL::coplanar_orientation(t[0], t[1], t[2], p) != CGAL::NEGATIVE &&
         CGAL::coplanar_orientation(t[0], t[2], t[1], p) != CGAL::NEGATIVE;
}

/// For a triangle `t` and a degenerate one.
bool crosses_degenerate(const Points& t, const Points& degenerate, const SharedCorners& shared) {
  if (shared.count > 1) return false;  // the line of an edge of t meets t in that edge alone
  if (shared.count == 1) {
    const auto [corner, own] = shared.at[0];
    const Points from = turned(t, corner);
    return enters(from, degenerate[(own + 1) % 3]) || enters(from, degenerate[(own + 2) % 3]);
  }
  const Kernel::Triangle_3 triangle(t[0], t[1], t[2]);
  const auto [least, most] = std::minmax_element(degenerate.begin(), degenerate.end());  // the ends, by coordinates
  return *least == *most ? CGAL::do_intersect(*least, triangle)
                         : CGAL::do_intersect(Kernel::Segment_3(*least, *most), triangle);
}

}  // namespace

Box box_of(const Corners& corners) {
  Box box;
  for (const glm::dvec3& p : corners) box.add(p);
  return box;
}

bool is_degenerate(const Corners& t) {
  if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return true;  // Equal corners need no exact arithmetic.
  // Each difference has a relative error of at most u = 2^-53, so a component of the normal that is larger than 8 u
  // times its two products is not zero. The products are compared with kSmallest, below which they lose bits.
  constexpr double kRounding = 8 * 0x1p-53, kSmallest = 1e-280;
  const glm::dvec3 u = t[1] - t[0], v = t[2] - t[0];
  for (int x = 0, y = 1, z = 2; x < 3; y = z, z = x++) {
    const double one = u[y] * v[z], other = u[z] * v[y], sum = std::abs(one) + std::abs(other);
    if (sum > kSmallest && std::abs(one - other) > kRounding * sum) return false;
  }
  const Points p = points(t);
  return CGAL::collinear(p[0], p[1], p[2]);
}

bool faces_cross_exactly(const Corners& a, const Corners& b) {
  const Points p = points(a), q = points(b);
  const bool thin_p = is_degenerate(a), thin_q = is_degenerate(b);
  if (thin_p && thin_q) return false;
  if (thin_q) return crosses_degenerate(p, q, shared_corners(a, b));
  if (thin_p) return crosses_degenerate(q, p, shared_corners(b, a));
  const SharedCorners shared = shared_corners(a, b);
  const auto [i, k] = shared.at[0];
  switch (shared.count) {
    case 0:
      return CGAL::do_intersect(Kernel::Triangle_3(p[0], p[1], p[2]), Kernel::Triangle_3(q[0], q[1], q[2]));
    case 1:
      return meet_beyond_corner(turned(p, i), turned(q, k));
    case 2: {
      const auto [j, l] = shared.at[1];
      return overlap_beside(p[i], p[j], p[3 - i - j], q[3 - k - l]);
    }
    default:
      return true;
  }
}

bool faces_cross(const Corners& a, const Corners& b) { return !surely_uncrossed(a, b) && faces_cross_exactly(a, b); }

}  // namespace tolvol
