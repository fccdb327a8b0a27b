// SPDX-License-Identifier: GPL-3.0-or-later
// Halving and quartering alone need pieces as small as the room that is left wherever the piece crosses from one
// triangle of the other surface to the next; what the one covers is therefore cut off in one go. The distance to a
// convex set is convex, and its sublevel sets are: the corners that are cut out are within, and so is all between them.
#include "check/part.h"

#include <algorithm>
#include <cmath>

namespace tolvol {
namespace {

constexpr double kCutAt = 0.9;         // of what is permitted; the rest is room for later changes
constexpr double kWorthCutting = 0.5;  // of a part's area
// The squared longest edge of what a cut leaves, over the part's. Cuts that leave it would go round in circles.
constexpr double kProgress2 = 0.6;

double squared_length(const glm::dvec3& v) { return glm::dot(v, v); }

/// From p, the nearer to which errs less, towards q.
glm::dvec3 between(const glm::dvec3& p, const glm::dvec3& q, double t) {
  return t <= 0.5 ? p + t * (q - p) : q + (1 - t) * (p - q);
}

/// Where on the way from a corner that is within to one that is not the distance may reach the limit.
double reach(double near, double far, double within) { return (within - near) / (far - near); }

/// The corner that is within when it is the only one, or the only one that is not.
int odd_one(const double (&distance)[3], double within, bool is_within) {
  return (distance[1] <= within) == is_within ? 1 : (distance[2] <= within) == is_within ? 2 : 0;
}

int count_within(const double (&distance)[3], double within) {
  return (distance[0] <= within) + (distance[1] <= within) + (distance[2] <= within);
}

/// How much of the area is sure to be `within`: along each edge the distance is at most what interpolating between its
/// ends gives.
double share_within(const double (&distance)[3], double within) {
  const int count = count_within(distance, within);
  if (count == 0 || count == 3) return count == 3;
  const int alone = odd_one(distance, within, count == 1);
  const double p = distance[alone], q = distance[(alone + 1) % 3], r = distance[(alone + 2) % 3];
  return count == 1 ? reach(p, q, within) * reach(p, r, within)
                    : 1 - (1 - reach(q, p, within)) * (1 - reach(r, p, within));
}

}  // namespace

double longest_squared(const Part& part) {
  const auto& c = part.corners;
  return std::max({squared_length(c[1] - c[0]), squared_length(c[2] - c[1]), squared_length(c[0] - c[2])});
}

void split(const Part& part, std::vector<Part>& out) {
  constexpr double kNeedle2 = 4;  // squared longest edge over the shortest: quarters of a needle are needles
  const auto& [a, b, c] = part.corners;
  const double ab2 = squared_length(b - a), bc2 = squared_length(c - b), ca2 = squared_length(a - c);
  const double longest2 = std::max({ab2, bc2, ca2});
  const glm::dvec3 ab = (a + b) * 0.5, bc = (b + c) * 0.5, ca = (c + a) * 0.5;
  const std::uint32_t cuts = part.cuts + 1;
  if (longest2 > kNeedle2 * std::min({ab2, bc2, ca2})) {
    if (ab2 == longest2) {
      out.push_back({{a, ab, c}, cuts}), out.push_back({{ab, b, c}, cuts});
    } else if (bc2 == longest2) {
      out.push_back({{b, bc, a}, cuts}), out.push_back({{bc, c, a}, cuts});
    } else {
      out.push_back({{c, ca, b}, cuts}), out.push_back({{ca, a, b}, cuts});
    }
    return;
  }
  out.push_back({{a, ab, ca}, cuts}), out.push_back({{ab, b, bc}, cuts});
  out.push_back({{ca, bc, c}, cuts}), out.push_back({{ab, bc, ca}, cuts});
}

bool Cover::improve(const double (&d2)[4], double permitted) {
  // Written so that NaN ends here.
  const double permitted2 = permitted * permitted;
  if (!(d2[0] <= permitted2 || d2[1] <= permitted2 || d2[2] <= permitted2)) return false;
  const double d[3] = {std::sqrt(d2[0]), std::sqrt(d2[1]), std::sqrt(d2[2])};
  const double covered = share_within(d, kCutAt * permitted);
  if (!(covered > share)) return false;
  share = covered, within = kCutAt * permitted;
  std::copy_n(d, 3, distance);
  return true;
}

bool cut(const Part& part, const Cover& cover, std::vector<Part>& inside, std::vector<Part>& rest) {
  if (!(cover.share >= kWorthCutting)) return false;
  const double(&distance)[3] = cover.distance;
  const double within = cover.within;
  const int count = count_within(distance, within), alone = odd_one(distance, within, count == 1);
  const int j = (alone + 1) % 3, k = (alone + 2) % 3;
  const glm::dvec3 &p = part.corners[alone], &q = part.corners[j], &r = part.corners[k];
  const auto at = [&](int other) {
    return count == 1 ? between(p, part.corners[other], reach(distance[alone], distance[other], within))
                      : between(part.corners[other], p, reach(distance[other], distance[alone], within));
  };
  const glm::dvec3 on_q = at(j), on_r = at(k);
  const std::uint32_t cuts = part.cuts + 1;
  const Part single{{p, on_q, on_r}, cuts};
  const bool from_q = squared_length(on_q - r) < squared_length(on_r - q);
  const Part pair[2] = {{{on_q, q, from_q ? r : on_r}, cuts},
                        {{from_q ? on_q : on_r, from_q ? r : q, from_q ? on_r : r}, cuts}};
  const double left2 =
      count == 1 ? std::max(longest_squared(pair[0]), longest_squared(pair[1])) : longest_squared(single);
  if (!(left2 <= kProgress2 * longest_squared(part))) return false;
  (count == 1 ? inside : rest).push_back(single);
  std::vector<Part>& others = count == 1 ? rest : inside;
  others.insert(others.end(), {pair[0], pair[1]});
  return true;
}

}  // namespace tolvol
