// SPDX-License-Identifier: GPL-3.0-or-later
// Two triangles are apart if along some direction all corners of one come before all corners of the other. Any
// direction proves it, however it was found, so that rounding matters in the products with the corners alone.
#include "topology/faces_apart.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry/lengths.h"
#include "topology/shared_corners.h"

namespace tolvol {
namespace {

using glm::dvec3;

/// Products of directions and differences of coordinates, and sums of three of them, have at most this error relative
/// to the sum of their parts; it is several times what the operations can round.
constexpr double kRounding = 16 * 0x1p-53;
/// What products that are too small for double precision lose, and the largest product that is trusted.
constexpr double kSmallest = 1e-300, kLargest = 1e300;
/// More than what the difference of two products loses in which they are too small. A large factor makes it count.
constexpr double kLost = 4 * std::numeric_limits<double>::denorm_min();

double sum(const dvec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); }

/// The corners of two triangles, from a corner of the first, and the largest coordinate.
struct Pair {
  dvec3 a[3], b[3];
  double size = 0;
};

Pair pair_of(const Corners& a, const Corners& b) {
  Pair pair;
  for (int k = 0; k < 3; ++k) {
    pair.a[k] = a[k] - a[0], pair.b[k] = b[k] - a[0];
    pair.size = std::max({pair.size, largest(pair.a[k]), largest(pair.b[k])});
  }
  return pair;
}

/// By how much one comes before the other along `u`, times its length; not positive where they overlap, or where a
/// product may be too large for double precision.
double gap_along(const dvec3& u, const Pair& pair) {
  const double most = sum(u) * pair.size;
  if (!(most < kLargest)) return 0;
  const double a0 = glm::dot(u, pair.a[0]), a1 = glm::dot(u, pair.a[1]), a2 = glm::dot(u, pair.a[2]);
  const double b0 = glm::dot(u, pair.b[0]), b1 = glm::dot(u, pair.b[1]), b2 = glm::dot(u, pair.b[2]);
  const double b_after_a = std::min({b0, b1, b2}) - std::max({a0, a1, a2});
  const double a_after_b = std::min({a0, a1, a2}) - std::max({b0, b1, b2});
  return std::max(b_after_a, a_after_b) - (4 * kRounding * most + kSmallest);
}

/// Returns the longest edge of the two triangles.
dvec3 longest_edge(const Pair& pair) {
  dvec3 longest(0);
  double most2 = 0;
  for (const auto* t : {&pair.a, &pair.b}) {
    for (int k = 0; k < 3; ++k) {
      const dvec3 edge = (*t)[k == 2 ? 0 : k + 1] - (*t)[k];
      if (const double length2 = squared_length(edge); length2 > most2) longest = edge, most2 = length2;
    }
  }
  return longest;
}

/// Calls visit(direction) for the directions along which they may be apart, until it returns true.
template <class Visit>
void for_each_direction(const Pair& pair, Visit&& visit) {
  const auto& [a, b, size] = pair;
  const dvec3 between = b[0] + b[1] + b[2] - (a[0] + a[1] + a[2]);
  if (visit(between)) return;
  // A needle or a segment and a triangle beside it are mostly apart along the part of `between` that is perpendicular
  // to the longest edge.
  const dvec3 along = longest_edge(pair);
  if (visit(squared_length(along) * between - glm::dot(along, between) * along)) return;
  const dvec3 normal_a = glm::cross(a[1] - a[0], a[2] - a[0]), normal_b = glm::cross(b[1] - b[0], b[2] - b[0]);
  if (visit(normal_a) || visit(normal_b)) return;
  for (int k = 0; k < 3; ++k) {
    const int next = k == 2 ? 0 : k + 1;
    if (visit(glm::cross(normal_a, a[next] - a[k])) || visit(glm::cross(normal_b, b[next] - b[k]))) return;
  }
}

/// The side of the plane through 0, u and v that p is on, as 1 or -1; 0 if rounding leaves a doubt.
int side(const dvec3& u, const dvec3& v, const dvec3& p) {
  const dvec3 normal = glm::cross(u, v);
  const dvec3 most(std::abs(u.y * v.z) + std::abs(u.z * v.y), std::abs(u.z * v.x) + std::abs(u.x * v.z),
                   std::abs(u.x * v.y) + std::abs(u.y * v.x));
  const double volume = glm::dot(normal, p);
  const double error = kRounding * glm::dot(most, glm::abs(p)) + kLost * sum(p) + kSmallest;
  return volume > error ? 1 : volume < -error ? -1 : 0;
}

/// For triangles with the corner 0 in common, and their other corners.
bool apart_beyond_corner(const dvec3& a1, const dvec3& a2, const dvec3& b1, const dvec3& b2) {
  if (const int s = side(a1, a2, b1); s != 0 && side(a1, a2, b2) == s) return true;
  if (const int s = side(b1, b2, a1); s != 0 && side(b1, b2, a2) == s) return true;
  // A plane between the middles of the two angles tells most needles around a corner in one plane from each other, for
  // which the predicates need exact arithmetic.
  const dvec3 u = unit(unit(b1) + unit(b2)) - unit(unit(a1) + unit(a2));
  const double error = kRounding * sum(u) * std::max({largest(a1), largest(a2), largest(b1), largest(b2)}) + kSmallest;
  return glm::dot(u, a1) < -error && glm::dot(u, a2) < -error && glm::dot(u, b1) > error && glm::dot(u, b2) > error;
}

}  // namespace

double gap(const Corners& a, const Corners& b, double enough) {
  const Pair pair = pair_of(a, b);
  double largest_gap = 0;
  for_each_direction(pair, [&](const dvec3& u) {
    const double along = gap_along(u, pair);
    if (along > 0) largest_gap = std::max(largest_gap, along / norm(u) * (1 - kRounding));
    return largest_gap >= enough;
  });
  return largest_gap;
}

bool surely_uncrossed(const Corners& a, const Corners& b) {
  const SharedCorners shared = shared_corners(a, b);
  const auto [i, k] = shared.at[0];
  switch (shared.count) {
    case 0: {
      const Pair pair = pair_of(a, b);
      bool apart = false;
      for_each_direction(pair, [&](const dvec3& u) { return apart = gap_along(u, pair) > 0; });
      return apart;
    }
    case 1: {
      const dvec3& corner = a[i];
      return apart_beyond_corner(a[(i + 1) % 3] - corner, a[(i + 2) % 3] - corner, b[(k + 1) % 3] - corner,
                                 b[(k + 2) % 3] - corner);
    }
    case 2: {
      const auto [j, l] = shared.at[1];
      const dvec3& corner = a[i];
      if (k == l) return false;  // two corners of the first triangle are one point
      return side(a[j] - corner, a[3 - i - j] - corner, b[3 - k - l] - corner) != 0;
    }
    default:
      return false;
  }
}

namespace {

/// Calls visit(corner) for the corners other than `hub`; for all corners if none of them is there, or all.
template <class Visit>
void for_each_of_rim(const Corners& corners, const dvec3& hub, Visit&& visit) {
  const auto at_hub = std::ranges::count(corners, hub);
  for (const dvec3& p : corners) {
    if (p != hub || at_hub == 3) visit(p);
  }
}

}  // namespace

Box rim_of(const Corners& corners, const dvec3& hub) {
  Box rim;
  for_each_of_rim(corners, hub, [&](const dvec3& p) { rim.add(p); });
  return rim;
}

Box directions_of(const Corners& corners, const dvec3& hub) {
  Box directions;
  for_each_of_rim(corners, hub, [&](const dvec3& p) {
    const dvec3 way = p - hub;
    const double length = largest(way);
    if (std::isfinite(length)) {
      directions.add(length > 0 ? way / length : way);
    } else {
      // The difference is too large for double precision: any direction.
      directions.add(dvec3(-1)), directions.add(dvec3(1));
    }
  });
  return directions;
}

ApartFromFan::ApartFromFan(const Corners& own, const dvec3& hub)
    : hub_(hub), whole_(box_of(own)), opposite_(rim_of(own, hub)) {
  // A side through the hub is turned by so little that the triangle lies strictly on one side of it.
  constexpr double kTurn = 1e-9;
  dvec3 from_hub[3];
  for (int k = 0; k < 3; ++k) from_hub[k] = own[k] - hub;
  const auto at = std::ranges::find(own, hub);
  shares_hub_ = at != own.end();
  if (shares_hub_) {
    const auto first = static_cast<std::size_t>(at - own.begin());
    const dvec3 one = unit(from_hub[(first + 1) % 3]), other = unit(from_hub[(first + 2) % 3]);
    const dvec3 normal = unit(glm::cross(one, other)), inwards = kTurn * (one + other);
    add(own, unit(glm::cross(one, normal)) - kTurn * one);
    add(own, unit(glm::cross(normal, other)) - kTurn * other);
    add(own, normal - inwards), add(own, -normal - inwards);
    return;
  }
  const dvec3 normal = unit(glm::cross(own[1] - own[0], own[2] - own[0]));
  add(own, glm::dot(normal, from_hub[0]) > 0 ? -normal : normal);
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    add(own, unit(glm::cross(own[next] - own[k], normal)));
    const dvec3 one = unit(from_hub[k]), other = unit(from_hub[next]), across = unit(glm::cross(one, other));
    const bool is_beyond = glm::dot(across, from_hub[(k + 2) % 3]) > 0;
    add(own, (is_beyond ? -across : across) - kTurn * (one + other));
  }
}

/// Adds a side if the triangle is surely on one side of it, and the hub on the other or on it.
void ApartFromFan::add(const Corners& own, const dvec3& normal) {
  double most = -std::numeric_limits<double>::infinity();
  for (const dvec3& corner : own) {
    if (shares_hub_ && corner == hub_) continue;
    const dvec3 p = corner - hub_;
    const double bound = glm::dot(normal, p) + 4 * kRounding * sum(normal) * largest(p) + kSmallest;
    if (!(bound < 0)) return;  // also if it is NaN, because rounding has left no direction
    most = std::max(most, bound);
  }
  if (std::isinf(most)) return;  // all corners are at the hub
  sides_[static_cast<std::size_t>(count_++)] = {normal, shares_hub_ ? 0 : most};
}

bool ApartFromFan::surely(const Box& rims) const {
  // Two faces with a common corner cross only if what is opposite the corner in one of them meets the other.
  Box faces = rims;
  faces.add(hub_);
  if (!meet(opposite_, faces) && !(shares_hub_ && meet(whole_, rims))) return true;
  return is_beyond_side({rims.lower - hub_, rims.upper - hub_});
}

bool ApartFromFan::is_beyond_side(const Box& from_hub) const {
  const auto& [lower, upper] = from_hub;
  const double size = std::max(largest(lower), largest(upper));
  for (int i = 0; i < count_; ++i) {
    const auto& [normal, most] = sides_[static_cast<std::size_t>(i)];
    double least = -(4 * kRounding * sum(normal) * size + kSmallest);
    for (int k = 0; k < 3; ++k) least += normal[k] * (normal[k] > 0 ? lower[k] : upper[k]);
    if (least > most) return true;
  }
  return false;
}

}  // namespace tolvol
