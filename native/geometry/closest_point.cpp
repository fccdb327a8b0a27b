// SPDX-License-Identifier: GPL-3.0-or-later
// This follows C. Ericson, Real-Time Collision Detection, 2005, §5.1.5, which walks the Voronoi regions of corners,
// edges and face, and solves the normal equations of the plane, whose error grows with the square of the aspect ratio.
// There are three deviations:
// - A triangle lower than a tenth of its longest edge takes nearest_of_thin, the best of the three clamped edges and of
//   the foot in an orthogonal frame on the longest edge, whose error does not grow with the aspect ratio.
// - One step of iterative refinement improves the foot of a well-shaped triangle.
// - Lengths outside 1e-60 .. 1e60 are scaled by a power of two first, because the fourth powers below would leave the
//   range of double.
//
// is_beyond tries the normal of the plane and, for needles side by side in one plane, the direction in the plane across
// the longest edge. For any n the triangle is at least m / |n| away, where m is the least n . (p - x) over its corners
// x, so that an inaccurate normal costs sharpness but never truth. With coordinates up to M and u = 2^-53, a difference
// p - x is at most 4 M long, and a dot product errs by at most 4 u 4 M |n|. The witness of closest_point errs by 20 u M
// and its distance by 4 u 4 M more. All this is less than e = 64 u M, and the code takes twice as much. With s the
// square root of `squared`, (s + e)^2 <= s^2 (1 + 1e-6) + e^2 (1 + 1e6) <= s^2 (1 + 1e-6) + 2e6 e^2.
//
// corner_noise covers the rounding of dot products like (p - a) . (b - a). With M and u as above both factors are at
// most 2 sqrt(3) M long, so that one product errs by less than 60 u M^2. Where the code compares a difference of two of
// them with 0, the errors of both count. A corner that is nearest by more than 512 u M^2 therefore passes the
// comparisons of its own region and none of another corner, a clamped edge ends in it exactly, and the edge opposite to
// it is farther by more than rounding. The foot in the frame of a thin triangle has a negative weight then: along the
// longest edge it is beyond an end by more than rounding if that is the corner, and else across it, because both edges
// at the corner lean back.
#include "geometry/closest_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/frame.h"
#include "geometry/lengths.h"

namespace tolvol {
namespace {

constexpr double kThin = 0.01;  // a triangle is thin below this ratio of its squared height to its squared longest edge
constexpr double kSmallest = 1e-60, kLargest = 1e60;
constexpr double kApart = 1e-6, kNoise = 128 * kUnitRoundoff;  // both are derived above
constexpr double kFlat = 1e-200;  // the products of a normal with a smaller square may have lost their bits

ClosestPoint at(const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& weights) {
  const glm::dvec3 r = p - q;
  return {q, weights, glm::dot(r, r)};
}

/// Returns the weight of `b` at the point of the segment a, b that is nearest to p. The two may be equal.
double segment_weight(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 ab = b - a;
  const double length2 = glm::dot(ab, ab);
  return length2 > 0 ? std::clamp(glm::dot(p - a, ab) / length2, 0.0, 1.0) : 0.0;
}

/// Returns a + t (b - a), computed from the nearer end, so that it is exact at both ends.
glm::dvec3 on_segment(const glm::dvec3& a, const glm::dvec3& b, double t) {
  return t <= 0.5 ? a + t * (b - a) : b - (1 - t) * (b - a);
}

ClosestPoint nearest_of_thin(const glm::dvec3& p, const glm::dvec3 (&corner)[3]) {
  ClosestPoint best{glm::dvec3(0), glm::dvec3(0), std::numeric_limits<double>::infinity()};
  int base = 0;  // the longest edge runs from corner[base] to the next corner
  double longest2 = -1;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const glm::dvec3 edge = corner[j] - corner[i];
    if (const double length2 = glm::dot(edge, edge); length2 > longest2) longest2 = length2, base = i;
    const double t = segment_weight(p, corner[i], corner[j]);
    glm::dvec3 weights(0);
    weights[i] = 1 - t, weights[j] = t;
    const ClosestPoint q = at(p, on_segment(corner[i], corner[j], t), weights);
    if (q.distance_squared < best.distance_squared) best = q;
  }
  const int i = base, j = (base + 1) % 3, k = (base + 2) % 3;
  const glm::dvec3 edge = corner[j] - corner[i];
  glm::dvec3 height = corner[k] - corner[i];
  double foot = 0;  // the place of the foot of corner k, as a share of the edge
  if (longest2 > 0) {
    for (int pass = 0; pass < 2; ++pass) {  // the second pass corrects the cancellation in the first
      const double s = glm::dot(height, edge) / longest2;
      height -= s * edge;
      foot += s;
    }
  }
  const double height2 = glm::dot(height, height);
  if (!(height2 > 0)) return best;
  const double y = glm::dot(p - corner[i], height) / height2;
  const double x = glm::dot(p - corner[i] - y * height, edge) / longest2;
  glm::dvec3 weights(0);
  weights[k] = y, weights[j] = x - y * foot, weights[i] = 1 - weights[j] - y;
  if (weights.x < 0 || weights.y < 0 || weights.z < 0) return best;
  const ClosestPoint q = at(p, corner[i] + weights[j] * edge + weights[k] * (corner[k] - corner[i]), weights);
  return q.distance_squared < best.distance_squared ? q : best;
}

ClosestPoint nearest_in_range(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 ab = b - a, ac = c - a, bc = c - b, n = glm::cross(ab, ac);
  const double ab2 = glm::dot(ab, ab), ac2 = glm::dot(ac, ac), n2 = glm::dot(n, n);
  const double longest2 = std::max({ab2, ac2, glm::dot(bc, bc)});
  if (!(n2 > kThin * longest2 * longest2)) return nearest_of_thin(p, {a, b, c});

  const glm::dvec3 ap = p - a, bp = p - b, cp = p - c;
  const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return at(p, a, {1, 0, 0});
  const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return at(p, b, {0, 1, 0});
  // All corners come before the edges, because the signs of the products below are less sure.
  const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return at(p, c, {0, 0, 1});
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = std::min(d1 / ab2, 1.0);
    return at(p, on_segment(a, b, t), {1 - t, t, 0});
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = std::min(d2 / ac2, 1.0);
    return at(p, on_segment(a, c, t), {1 - t, 0, t});
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = segment_weight(p, b, c);
    return at(p, on_segment(b, c, t), {0, 1 - t, t});
  }
  double v = std::clamp(vb / n2, 0.0, 1.0), w = std::clamp(vc / n2, 0.0, 1 - v);
  glm::dvec3 q = a + v * ab + w * ac;
  const glm::dvec3 r = p - q;
  const double e = glm::dot(ab, r), f = glm::dot(ac, r), g = glm::dot(ab, ac);
  const double v1 = v + (ac2 * e - g * f) / n2, w1 = w + (ab2 * f - g * e) / n2;
  if (v1 >= 0 && w1 >= 0 && v1 + w1 <= 1) {
    v = v1, w = w1;
    q = a + v * ab + w * ac;
  }
  return at(p, q, {std::max(1 - v - w, 0.0), v, w});  // v + w may be 1 by rounding alone
}

}  // namespace

double corner_noise(double size) { return 512 * kUnitRoundoff * size * size; }

ClosestPoint closest_point(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const double length = std::max({largest(p - a), largest(b - a), largest(c - a)});
  if (length >= kSmallest && length <= kLargest) return nearest_in_range(p, a, b, c);
  // Both are halved first, because the difference may overflow.
  const double half = std::max({largest(0.5 * p - 0.5 * a), largest(0.5 * b - 0.5 * a), largest(0.5 * c - 0.5 * a)});
  if (half == 0) return at(p, a, {1, 0, 0});
  if (!std::isfinite(half)) return {a, {1, 0, 0}, std::numeric_limits<double>::quiet_NaN()};
  const int exponent = std::ilogb(half);
  auto shifted = [](const glm::dvec3& x, int by) {
    return glm::dvec3(std::ldexp(x.x, by), std::ldexp(x.y, by), std::ldexp(x.z, by));
  };
  ClosestPoint q =
      nearest_in_range(shifted(p, -exponent), shifted(a, -exponent), shifted(b, -exponent), shifted(c, -exponent));
  q.point = shifted(q.point, exponent);
  q.distance_squared = std::ldexp(q.distance_squared, 2 * exponent);
  return q;
}

bool is_beyond(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double squared) {
  const double noise = kNoise * std::max({largest(p), largest(a), largest(b), largest(c)});
  const double least = squared * (1 + kApart) + 2 / kApart * noise * noise;
  const auto shown_by = [&](const glm::dvec3& n) {
    const double n2 = glm::dot(n, n), at_a = glm::dot(n, p - a), at_b = glm::dot(n, p - b), at_c = glm::dot(n, p - c);
    const double gap = std::max(std::min({at_a, at_b, at_c}), -std::max({at_a, at_b, at_c}));
    return n2 > kFlat && gap > 0 && gap * gap > n2 * least;
  };
  const glm::dvec3 ab = b - a, bc = c - b, ca = a - c, normal = glm::cross(ab, bc);
  if (shown_by(normal)) return true;
  const double ab2 = glm::dot(ab, ab), bc2 = glm::dot(bc, bc), ca2 = glm::dot(ca, ca);
  return shown_by(glm::cross(normal, ab2 >= bc2 && ab2 >= ca2 ? ab : bc2 >= ca2 ? bc : ca));
}

}  // namespace tolvol
