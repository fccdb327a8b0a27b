// SPDX-License-Identifier: GPL-3.0-or-later
// Halving alone would never end along the edges of the other surface if the two surfaces touch, and it would need as
// many pieces as fit along the line where two of its sheets are as near. Cutting alone would go round in circles far
// from the other surface.
//
// This derives kSplitError, with u = 2^-53. A point p + t (q - p) at t <= 1/2 from the nearer end, with |p|, |q| <= 1,
// errs by t 2 u for the difference, as much for the product, and u for the sum, which is 3 u.
#include "measure/split.h"

#include <algorithm>
#include <cmath>

#include "geometry/closest_point.h"

namespace tolvol {
namespace {

using glm::dvec3;

// A piece this many times longer than the triangle near it is halved, not cut.
constexpr double kCoarse = 4;
// A piece is cut between two triangles only where both parts have at least this share of it, so that pieces shrink.
constexpr double kWellInside = 0.125;
// A piece or a part thinner than this, in frame lengths, is as small as rounding.
constexpr double kThinnest = 256 * kUnitRoundoff;

dvec3 between(const dvec3& p, const dvec3& q, double t) { return t <= 0.5 ? p + t * (q - p) : q + (1 - t) * (p - q); }

/// Returns two parts, which are divided at the point s of the edge from corner i to the next.
Parts halves(const TriangleCorners& p, int i, double s) {
  const int j = (i + 1) % 3;
  Parts parts{{p, p, p}, 2};
  parts.corners[0][j] = parts.corners[1][i] = between(p[i], p[j], s);
  return parts;
}

/// Returns the parts on the two sides of a line through the piece. The corners have these signed distances from it,
/// which are of both signs.
Parts cut_at(const TriangleCorners& p, const std::array<double, 3>& side) {
  const auto share = [&](int i, int j) { return side[i] / (side[i] - side[j]); };
  int alone = 0;  // is the only corner on its side
  for (int i = 0; i < 3; ++i) {
    if (side[i] == 0) return halves(p, (i + 1) % 3, share((i + 1) % 3, (i + 2) % 3));
    if (side[i] * side[(i + 1) % 3] < 0 && side[i] * side[(i + 2) % 3] < 0) alone = i;
  }
  const int i = alone, j = (alone + 1) % 3, k = (alone + 2) % 3;
  const dvec3 on_j = between(p[i], p[j], share(i, j)), on_k = between(p[i], p[k], share(i, k));
  if (glm::distance(on_j, p[k]) < glm::distance(on_k, p[j])) {
    return {{{{p[i], on_j, on_k}, {on_j, p[j], p[k]}, {on_j, p[k], on_k}}}, 3};
  }
  return {{{{p[i], on_j, on_k}, {on_j, p[j], on_k}, {on_k, p[j], p[k]}}}, 3};
}

/// Returns no part if no edge of t divides the piece, nor an end of t if t is flat within rounding: a segment.
Parts cut_along(const TriangleCorners& p, const TriangleCorners& t) {
  const dvec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
  int longest = 0;
  std::array<double, 3> length;
  for (int e = 0; e < 3; ++e) {
    length[e] = glm::distance(t[e], t[(e + 1) % 3]);
    if (length[e] > length[longest]) longest = e;
  }
  const bool flat = glm::length(normal) <= kThinnest * length[longest];
  const dvec3 segment = t[(longest + 1) % 3] - t[longest];
  std::array<double, 3> side{};
  double best = 0;
  for (int e = 0; e < 3; ++e) {
    if (flat && e == (longest + 2) % 3) continue;  // is between the ends
    const dvec3 outward = !flat ? glm::cross(t[(e + 1) % 3] - t[e], normal) : e == longest ? -segment : segment;
    const double norm = glm::length(outward);
    if (!(norm > 0)) continue;
    std::array<double, 3> s;
    for (int i = 0; i < 3; ++i) s[i] = glm::dot(p[i] - t[e], outward) / norm;
    const double depth = std::min(*std::max_element(s.begin(), s.end()), -*std::min_element(s.begin(), s.end()));
    if (depth > best) best = depth, side = s;
  }
  if (best <= kThinnest) return {};
  for (double& s : side) {
    if (std::abs(s) <= kThinnest) s = 0;
  }
  return cut_at(p, side);
}

/// Cuts where t and `other` are about as near, which is on a line if each is nearest with its plane. Returns no part if
/// that is not well inside the piece.
Parts cut_between(const TriangleCorners& p, const TriangleCorners& t, const TriangleCorners& other) {
  const auto distance = [](const dvec3& x, const TriangleCorners& from) {
    return std::sqrt(closest_point(x, from[0], from[1], from[2]).distance_squared);
  };
  std::array<double, 3> side;
  for (int i = 0; i < 3; ++i) side[i] = distance(p[i], other) - distance(p[i], t);
  const auto [least, most] = std::minmax({side[0], side[1], side[2]});
  if (std::min(-least, most) <= std::max(kThinnest, kWellInside * (most - least))) return {};
  for (double& s : side) {
    if (std::abs(s) <= kThinnest) s = 0;
  }
  return cut_at(p, side);
}

/// Returns the point that divides the segment from p to q best.
dvec3 cut_of_segment(const dvec3& p, const dvec3& q, const TriangleCorners& t, bool coarse) {
  const Parts parts = coarse ? Parts{} : cut_along({p, q, q}, t);
  return parts.count > 0 ? parts.corners[0][1] : between(p, q, 0.5);
}

}  // namespace

Parts split(const TriangleCorners& piece, const TriangleCorners& t, const TriangleCorners& other) {
  const double reach = std::max({glm::distance(t[0], t[1]), glm::distance(t[1], t[2]), glm::distance(t[2], t[0])});
  int longest = 0;
  std::array<double, 3> length;
  for (int i = 0; i < 3; ++i) {
    length[i] = glm::distance(piece[i], piece[(i + 1) % 3]);
    if (length[i] > length[longest]) longest = i;
  }
  Parts parts;
  if (length[longest] <= kThinnest) return parts;
  const bool coarse = length[longest] > kCoarse * reach;
  for (int i = 0; i < 3; ++i) {
    if (length[i] > 0) continue;
    // If a segment were divided as a triangle, two of its three parts would cover the same half, and so on with each.
    const dvec3 &p = piece[i], &q = piece[(i + 2) % 3], at = cut_of_segment(p, q, t, coarse);
    return {{{{p, at, at}, {at, q, q}}}, 2};
  }
  if (!coarse) parts = cut_along(piece, t);
  if (!coarse && parts.count == 0) parts = cut_between(piece, t, other);
  return parts.count > 0 ? parts : halves(piece, longest, 0.5);
}

}  // namespace tolvol
