// SPDX-License-Identifier: GPL-3.0-or-later
// Let c be the centroid of the piece, p_i its corners, r the largest |p_i - c| and d(x) the distance to b.
//
// - The upper ends: the distance to the triangle T nearest to c is convex. Over the piece it is at most the linear
//   function of its values at the corners. d is nowhere larger. Its square: with y_i the point of T nearest to p_i, the
//   point x = sum w_i p_i is at most |sum w_i (p_i - y_i)| from sum w_i y_i, which is on T. The mean of the square of
//   this linear vector v is |m|^2 + sum |v_i - m|^2 / (k (k + 1)), where m is the mean of the v_i. The same with one
//   point, that nearest to c, for all y_i is sharper where T is small. The mean of d is at most the root of the mean of
//   d^2.
// - The lower ends: the triangle nearest to any point of the piece is within d(c) + 2 r of c. The distance to each such
//   triangle is nowhere below a linear function for each plane that separates it from c. The least of one such function
//   for each triangle is concave, so that over the piece it is at least the least of its values at the corners, and on
//   average at least their mean. Two planes are tried: the plane at the point nearest to c, and the plane parallel to
//   T, without which the triangles beside T would seem to come nearer.
// - Both ends again for each quarter of the piece, with the triangles that are known by now. The corners of a quarter
//   are corners of the piece and middles of its sides. The least function is concave between them, and each quarter has
//   a triangle of its own for the upper end.
// - The lower ends if this takes too many triangles, because the surfaces are far apart for their size: for x = sum w_i
//   p_i and every y, |x - y|^2 = sum w_i |p_i - y|^2 - sum w_i |p_i - x|^2 (Lagrange), hence d(x)^2 >= sum w_i d(p_i)^2
//   - sum w_i |p_i - x|^2. For k corners the last term is at most r^2, and sum |p_i - c|^2 / (k + 1) on average.
//
// Rounding is covered as follows, with u = 2^-53 and |x| <= 1 for every point. The computed distance from a point to
// the witness on T falls short of the distance to T by at most 20 u (measure/hausdorff.cpp derives this). A plane never
// takes its offset from a distance, because a short difference has the direction of its rounding, and T may reach far
// to the other side of a plane that is turned by it. The offset is the least over the corners of T, which errs by 16 u
// whatever the direction is, and by 8 u more at a corner of the piece. Placing both meshes errs by 5 u, where a vertex
// of b is cut off (measure/near_part.h), and the centroid and the mean of the corners by 4 u each. A b that is smaller
// than 4 u is one triangle of it (measure/sampled_surface.cpp) instead of them. kRounding is above the sum.
#include "measure/distance_bounds.h"

#include <algorithm>
#include <cmath>

#include "geometry/frame.h"

namespace tolvol {
namespace {

using glm::dvec3;

// Planes are used for at most this many triangles. More of them would cost more than another four pieces.
constexpr int kMostTriangles = 64;
// One point is enough for a piece shorter than this share of the distance, because the distance changes by at most the
// way.
constexpr double kShort = 1e-4;
// Bounds that differ by a smaller share are not sharpened.
constexpr double kSharp = 1e-5;
// A piece that is nowhere farther from b than this, in the frame, touches b within rounding.
constexpr double kTouching = 4 * kUnitRoundoff;
// This is a length in the frame. Its derivation is above.
constexpr double kRounding = 64 * kUnitRoundoff;

dvec3 direction(const dvec3& v) {
  const double length = glm::length(v);
  return length < 1e-150 ? dvec3(0) : v / length;  // the square of a shorter vector has lost its bits
}

/// Returns how far p is from all of t on the side to which `normal`, of length 1 or 0, points, or less than 0 if it is
/// not.
double gap(const dvec3& p, const Corners& t, const dvec3& normal) {
  return std::min({glm::dot(normal, p - t[0]), glm::dot(normal, p - t[1]), glm::dot(normal, p - t[2])});
}

/// Returns the normal of the plane that separates p from t best. The choice is between the plane at `nearest`, the
/// point of t nearest to p, and the plane parallel to t, which stays sharp if p is within rounding of t.
dvec3 apart(const dvec3& p, const Corners& t, const dvec3& nearest) {
  const dvec3 towards = direction(p - nearest);
  const dvec3 face = direction(glm::cross(t[1] - t[0], t[2] - t[0]));
  const dvec3 facing = glm::dot(face, p - t[0]) < 0 ? -face : face;
  return gap(p, t, facing) > gap(p, t, towards) ? facing : towards;
}

Corners corners(const TriangleMesh& b, std::uint32_t triangle) {
  const glm::uvec3& t = b.triangles[triangle];
  return {b.vertices[t.x], b.vertices[t.y], b.vertices[t.z]};
}

/// Returns the upper ends by the distances of the corners from one triangle of b.
DistanceBounds above(const Simplex& piece, const TriangleMesh& b, std::uint32_t triangle) {
  const Corners t = corners(b, triangle);
  const int k = piece.corners;
  DistanceBounds bounds;
  bounds.nearest = triangle;
  Corners way;
  dvec3 middle(0);
  for (int i = 0; i < k; ++i) {
    const ClosestPoint q = closest_point(piece.corner[i], t[0], t[1], t[2]);
    bounds.upper[i] = std::sqrt(q.distance_squared);
    bounds.value.upper = std::max(bounds.value.upper, bounds.upper[i]);
    bounds.mean.upper += bounds.upper[i] / k;
    way[i] = piece.corner[i] - q.point;
    middle += way[i] / double(k);
  }
  bounds.mean_square.upper = glm::dot(middle, middle);
  for (int i = 0; i < k; ++i) bounds.mean_square.upper += glm::dot(way[i] - middle, way[i] - middle) / (k * (k + 1));
  return bounds;
}

/// Holds the least value of the linear functions above, one for each triangle, at the corners of a piece and at the
/// middles of its sides. The least function is concave, and thus above the linear one between the values on each
/// quarter of the piece: halving a piece would need two more searches for as much.
class Below {
 public:
  /// `nearest` is the point nearest to the centroid of the nearest triangle t.
  Below(const Simplex& piece, const dvec3& centroid, const TriangleMesh& b, const Hierarchy::Nearest& nearest)
      : b_(b), corners_(piece.corners), count_(corners_ * (corners_ + 1) / 2), centroid_(centroid) {
    for (int i = 0; i < corners_; ++i) arm_[i] = piece.corner[i] - centroid;
    for (int i = corners_; i < count_; ++i) arm_[i] = 0.5 * (arm_[i - corners_] + arm_[(i - corners_ + 1) % corners_]);
    const Corners t = corners(b, nearest.triangle);
    apart_ = apart(centroid, t, nearest.point);
    least_ = values(t, apart_);
    near_.fill({nearest.triangle, 0});
    for (int i = 0; i < quarters(); ++i) {
      middle_[i] = centroid + (arm_[kQuarter[i][0]] + arm_[kQuarter[i][1]] + arm_[kQuarter[i][2]]) / 3.0;
      near_[i].squared = closest_point(middle_[i], t[0], t[1], t[2]).distance_squared;
    }
  }

  void add(std::uint32_t triangle) {
    const Corners t = corners(b_, triangle);
    const Values common = values(t, apart_);
    const double lost = loss(common);
    if (lost == 0) return come_near(triangle, t, common);
    const Values own = values(t, apart(centroid_, t, closest_point(centroid_, t[0], t[1], t[2]).point));
    const Values& better = loss(own) <= lost ? own : common;
    for (int i = 0; i < count_; ++i) least_[i] = std::min(least_[i], better[i]);
    come_near(triangle, t, better);
  }

  /// Sets the lower ends, and lowers the upper ends, but for rounding.
  void write(DistanceBounds& bounds) const {
    std::copy_n(least_.begin(), corners_, bounds.lower.begin());
    const double mean = (least_[0] + least_[1] + least_[2]) / 3;
    if (corners_ < 3 || mean >= (1 - kSharp) * bounds.mean.upper) return;
    double upper = 0, square = 0;
    for (int i = 0; i < quarters(); ++i) {
      const auto& [a, b, c] = kQuarter[i];
      const double below = std::max(0.0, (least_[a] + least_[b] + least_[c]) / 3);
      bounds.mean.lower += below / 4;
      bounds.mean_square.lower += below * below / 4;
      const DistanceBounds quarter =
          above({{centroid_ + arm_[a], centroid_ + arm_[b], centroid_ + arm_[c]}, 3}, b_, near_[i].triangle);
      bounds.quarters[i] = {std::min({least_[a], least_[b], least_[c]}), quarter.value.upper};
      upper += std::min(quarter.mean.upper, std::sqrt(quarter.mean_square.upper)) / 4;
      square += quarter.mean_square.upper / 4;
    }
    bounds.mean.upper = std::min(bounds.mean.upper, upper);
    bounds.mean_square.upper = std::min(bounds.mean_square.upper, square);
  }

 private:
  using Values = std::array<double, 6>;
  static constexpr int kQuarter[4][3] = {{0, 3, 5}, {1, 4, 3}, {2, 5, 4}, {3, 4, 5}};

  int quarters() const { return corners_ == 3 ? 4 : 0; }

  /// Keeps the triangle t, whose distance is at least `below`, for the quarters whose middle it is nearest to.
  void come_near(std::uint32_t triangle, const Corners& t, const Values& below) {
    for (int i = 0; i < quarters(); ++i) {
      const double at = (below[kQuarter[i][0]] + below[kQuarter[i][1]] + below[kQuarter[i][2]]) / 3;
      if (at > 0 && at * at >= (1 - kSharp) * near_[i].squared) continue;
      const double squared = closest_point(middle_[i], t[0], t[1], t[2]).distance_squared;
      if (squared < near_[i].squared) near_[i] = {triangle, squared};
    }
  }

  /// Returns the values of the distance from the plane that touches t and has the unit vector `normal`.
  Values values(const Corners& t, const dvec3& normal) const {
    const double at_centroid = gap(centroid_, t, normal);
    Values result{};
    for (int i = 0; i < count_; ++i) result[i] = at_centroid + glm::dot(normal, arm_[i]);
    return result;
  }

  /// Returns by how much `least_` would fall.
  double loss(const Values& v) const {
    double sum = 0;
    for (int i = 0; i < count_; ++i) sum += std::max(0.0, least_[i] - v[i]);
    return sum;
  }

  struct Near {
    std::uint32_t triangle;
    double squared;
  };

  const TriangleMesh& b_;
  int corners_, count_;
  dvec3 centroid_, apart_{0};
  std::array<dvec3, 4> middle_{};  // are the middles of the quarters
  std::array<Near, 4> near_{};
  std::array<dvec3, 6> arm_{};  // lead from the centroid to the corners and middles
  Values least_{};
};

/// Returns the bounds with what follows from the values at the corners, widened by the rounding of their arithmetic.
DistanceBounds rounded_outwards(DistanceBounds bounds, int k) {
  const auto least = std::min_element(bounds.lower.begin(), bounds.lower.begin() + k);
  double mean = 0, spread = 0;
  for (int i = 0; i < k; ++i) mean += bounds.lower[i] / k;
  for (int i = 0; i < k; ++i) spread += (bounds.lower[i] - mean) * (bounds.lower[i] - mean);
  bounds.value.lower = std::max(bounds.value.lower, *least);
  bounds.mean.lower = std::max(bounds.mean.lower, mean);
  const double square_of_mean = bounds.mean.lower * bounds.mean.lower;
  const double of_linear = *least >= 0 ? mean * mean + spread / (k * (k + 1)) : 0;
  bounds.mean_square.lower = std::max({bounds.mean_square.lower, square_of_mean, of_linear});
  bounds.mean.upper = std::min(bounds.mean.upper, std::sqrt(bounds.mean_square.upper));
  for (int i = 0; i < k; ++i) bounds.lower[i] -= kRounding, bounds.upper[i] += kRounding;
  for (Range& quarter : bounds.quarters) {
    quarter.lower = std::max(quarter.lower - kRounding, 0.0);
    quarter.upper = quarter.upper > 0 ? quarter.upper + kRounding : bounds.value.upper + kRounding;
  }
  const double square = kRounding * (2 * bounds.value.upper + kRounding);
  for (Range* range : {&bounds.value, &bounds.mean}) range->lower -= kRounding, range->upper += kRounding;
  bounds.mean_square.lower -= square;
  bounds.mean_square.upper += square;
  for (Range* range : {&bounds.value, &bounds.mean, &bounds.mean_square}) range->lower = std::max(0.0, range->lower);
  return bounds;
}

}  // namespace

dvec3 Simplex::centroid() const {
  dvec3 sum(0);
  for (int i = 0; i < corners; ++i) sum += corner[i];
  return sum / double(corners);
}

DistanceBounds distance_bounds(const Simplex& piece, const TriangleMesh& b, const Hierarchy& hierarchy,
                               std::uint32_t hint) {
  const dvec3 c = piece.centroid();
  const int k = piece.corners;
  const Hierarchy::Nearest nearest = hierarchy.nearest(c, std::numeric_limits<double>::infinity(), hint);
  const double d = nearest.distance;
  DistanceBounds bounds = above(piece, b, nearest.triangle);
  bounds.steps = nearest.nodes;
  double r = 0, spread = 0;
  for (int i = 0; i < k; ++i) {
    const dvec3 arm = piece.corner[i] - c;
    spread += glm::dot(arm, arm);
    r = std::max(r, glm::length(arm));
  }

  // The distance to the nearest point alone, whose square has this mean, is sharper for a large piece.
  bounds.mean_square.upper = std::min(bounds.mean_square.upper, d * d + spread / (k * (k + 1)));
  if (r <= kShort * d) {
    bounds.value = {d - r, d + r};
    bounds.lower.fill(d - r);
    bounds.upper.fill(d + r);
    return rounded_outwards(bounds, k);
  }
  if (bounds.value.upper <= kTouching) return rounded_outwards(bounds, k);

  std::array<std::uint32_t, kMostTriangles> around;
  int seen = 0;
  const std::size_t nodes = hierarchy.for_each_within(c, d + 2 * r, [&](std::uint32_t i) {
    if (seen < kMostTriangles) around[seen] = i;
    return ++seen <= kMostTriangles;
  });
  bounds.steps += std::uint32_t(nodes) + std::uint32_t(seen);
  if (seen <= kMostTriangles) {
    Below below(piece, c, b, nearest);
    for (int i = 0; i < seen; ++i) below.add(around[i]);
    below.write(bounds);
  } else {
    double sum = 0, least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < k; ++i) {
      const Hierarchy::Nearest corner =
          hierarchy.nearest(piece.corner[i], std::numeric_limits<double>::infinity(), nearest.triangle);
      const double squared = corner.distance * corner.distance;
      bounds.steps += corner.nodes;
      bounds.lower[i] = squared - r * r;
      least = std::min(least, bounds.lower[i]);
      sum += squared / k;
    }
    // The root of a linear function is concave where the function is not below 0.
    const double shortest = std::max(0.0, d - r);
    for (int i = 0; i < k; ++i) bounds.lower[i] = least > shortest * shortest ? std::sqrt(bounds.lower[i]) : shortest;
    bounds.mean_square.lower = std::max(0.0, sum - spread / (k + 1));
    // This holds because d = d^2 / d, and d is nowhere larger than value.upper.
    bounds.mean.lower = bounds.mean_square.lower / bounds.value.upper;
  }
  return rounded_outwards(bounds, k);
}

DistanceBounds bounds_around(const dvec3& point, const Hierarchy::Nearest& nearest, const Simplex& piece,
                             const TriangleMesh& b) {
  DistanceBounds bounds = above(piece, b, nearest.triangle);
  double r = 0;
  for (int i = 0; i < piece.corners; ++i) r = std::max(r, glm::distance(piece.corner[i], point));
  bounds.lower.fill(std::max(0.0, nearest.distance - r));
  return rounded_outwards(bounds, piece.corners);
}

}  // namespace tolvol
