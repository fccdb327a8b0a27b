// SPDX-License-Identifier: GPL-3.0-or-later
// Halving and quartering alone need pieces as small as the room that is left wherever a piece crosses from one triangle
// of the other surface to the next. After a cut along the edge between the two, a triangle covers each side.
#include "check/part.h"

#include <algorithm>
#include <cmath>

#include "geometry/lengths.h"

namespace tolvol {
namespace {

/// Returns the point at share t of the way from p to q. It starts from the nearer of the two, which errs less.
glm::dvec3 between(const glm::dvec3& p, const glm::dvec3& q, double t) {
  return t <= 0.5 ? p + t * (q - p) : q + (1 - t) * (p - q);
}

}  // namespace

double longest_squared(const Part& part) {
  const auto& c = part.corners;
  return std::max({squared_length(c[1] - c[0]), squared_length(c[2] - c[1]), squared_length(c[0] - c[2])});
}

void split(const Part& part, std::vector<Part>& out) {
  // The longest squared edge of a needle is more than this many times its shortest. Quarters of a needle are needles.
  constexpr double kNeedle2 = 4;
  const auto& [a, b, c] = part.corners;
  const double ab2 = squared_length(b - a), bc2 = squared_length(c - b), ca2 = squared_length(a - c);
  const double longest2 = std::max({ab2, bc2, ca2});
  const glm::dvec3 ab = (a + b) * 0.5, bc = (b + c) * 0.5, ca = (c + a) * 0.5;
  const std::uint32_t cuts = part.cuts + 1;
  if (b == c) {
    out.push_back({{a, ab, ab}, cuts, part.of}), out.push_back({{ab, b, b}, cuts, part.of});
    return;
  }
  if (longest2 > kNeedle2 * std::min({ab2, bc2, ca2})) {
    if (ab2 == longest2) {
      out.push_back({{a, ab, c}, cuts, part.of}), out.push_back({{ab, b, c}, cuts, part.of});
    } else if (bc2 == longest2) {
      out.push_back({{b, bc, a}, cuts, part.of}), out.push_back({{bc, c, a}, cuts, part.of});
    } else {
      out.push_back({{c, ca, b}, cuts, part.of}), out.push_back({{ca, a, b}, cuts, part.of});
    }
    return;
  }
  out.push_back({{a, ab, ca}, cuts, part.of}), out.push_back({{ab, b, bc}, cuts, part.of});
  out.push_back({{ca, bc, c}, cuts, part.of}), out.push_back({{ab, bc, ca}, cuts, part.of});
}

bool cut(const Part& part, const WitnessTriangle& t, double least, std::vector<Part>& out) {
  double best = least, distance[3];
  // A linear function is 0 on the plane of an edge and grows inwards. `gradient` is its gradient, `at_a` its value at
  // a.
  const auto consider = [&](const glm::dvec3& gradient, double at_a) {
    const double scale = 1 / glm::length(gradient);
    double d[3], high = 0, low = 0;
    for (int i = 0; i < 3; ++i) {
      d[i] = (at_a + glm::dot(gradient, part.corners[i] - t.a)) * scale;
      high = std::max(high, d[i]), low = std::max(low, -d[i]);
    }
    if (!(std::min(high, low) > best) || !std::isfinite(d[0] + d[1] + d[2])) return;
    best = std::min(high, low);
    std::copy_n(d, 3, distance);
  };
  if (t.gs == glm::dvec3(0) && t.gt == glm::dvec3(0)) {  // the triangle is a segment: this cuts across its ends
    const glm::dvec3& along = squared_length(t.ab) > squared_length(t.ac) ? t.ab : t.ac;
    consider(along, 0), consider(-along, squared_length(along));
  } else {
    consider(t.gs, 0), consider(t.gt, 0), consider(-t.gs - t.gt, 1);
  }
  if (!(best > least)) return false;
  // The corner p is on one side; q and r are on the other or on the edge.
  const int inside = (distance[0] > 0) + (distance[1] > 0) + (distance[2] > 0);
  const bool odd = inside == 1;
  const int alone = (distance[1] > 0) == odd ? 1 : (distance[2] > 0) == odd ? 2 : 0;
  const int j = (alone + 1) % 3, k = (alone + 2) % 3;
  const glm::dvec3 &p = part.corners[alone], &q = part.corners[j], &r = part.corners[k];
  const glm::dvec3 on_q = between(p, q, distance[alone] / (distance[alone] - distance[j])),
                   on_r = between(p, r, distance[alone] / (distance[alone] - distance[k]));
  const std::uint32_t cuts = part.cuts + 1;
  out.push_back({{p, on_q, on_r}, cuts, part.of});
  if (q == r) {
    out.push_back({{on_q, q, q}, cuts, part.of});
    return true;
  }
  const bool from_q = squared_length(on_q - r) < squared_length(on_r - q);
  out.push_back({{on_q, q, from_q ? r : on_r}, cuts, part.of});
  out.push_back({{from_q ? on_q : on_r, from_q ? r : q, from_q ? on_r : r}, cuts, part.of});
  return true;
}

}  // namespace tolvol
