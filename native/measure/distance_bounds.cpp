// SPDX-License-Identifier: GPL-3.0-or-later
// Let c be the centroid of the piece, p_i its corners, r the largest |p_i - c| and d(x) the distance to b.
//
// - The upper ends: the distance to the triangle T nearest to c is convex, and so is its square. Over the piece they
//   are at most the largest of their values at the corners, and on average at most the mean of these. d is nowhere
//   larger.
// - The lower ends: the triangle nearest to any point of the piece is within d(c) + 2 r of c. The distance to each such
//   triangle is nowhere below a linear function for each plane that separates it from c. The least of one such function
//   for each triangle is concave, so that over the piece it is at least the least of its values at the corners, and on
//   average at least their mean. Two planes are tried: the plane at the point nearest to c, and the plane parallel to
//   T, without which the triangles beside T would seem to come nearer.
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
// than 4 u is one triangle of it (measure/deviation.cpp) instead of them. kRounding is above the sum.
#include "measure/distance_bounds.h"

#include <algorithm>
#include <cmath>

#include "geometry/frame.h"

namespace tolvol {
namespace {

using glm::dvec3;
using Values = std::array<double, 3>;  // are the values at the corners of a piece

// Planes are used for at most this many triangles. More of them would cost more than another four pieces.
constexpr int kMostTriangles = 64;
// One point is enough for a piece shorter than this share of the distance, because the distance changes by at most the
// way.
constexpr double kShort = 1e-4;
constexpr double kRounding = 64 * kUnitRoundoff;  // is in frame lengths, and derived above

using Corners = std::array<dvec3, 3>;

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
  for (int i = 0; i < k; ++i) {
    const double squared = closest_point(piece.corner[i], t[0], t[1], t[2]).distance_squared;
    bounds.value.upper = std::max(bounds.value.upper, std::sqrt(squared));
    bounds.mean.upper += std::sqrt(squared) / k;
    bounds.mean_square.upper += squared / k;
  }
  return bounds;
}

/// Holds at each corner of a piece the least value of the linear functions above, one for each triangle.
class Below {
 public:
  /// `nearest` is the point nearest to the centroid of the nearest triangle t.
  Below(const Simplex& piece, const dvec3& centroid, const Corners& t, const dvec3& nearest)
      : piece_(piece), centroid_(centroid), apart_(apart(centroid, t, nearest)), least_(values(t, apart_)) {}

  void add(const Corners& t) {
    const Values common = values(t, apart_);
    if (loss(common) == 0) return;
    const Values own = values(t, apart(centroid_, t, closest_point(centroid_, t[0], t[1], t[2]).point));
    const Values& better = loss(own) <= loss(common) ? own : common;
    for (int i = 0; i < piece_.corners; ++i) least_[i] = std::min(least_[i], better[i]);
  }

  double least() const { return std::max(0.0, *std::min_element(least_.begin(), least_.begin() + piece_.corners)); }
  double mean() const {
    double sum = 0;
    for (int i = 0; i < piece_.corners; ++i) sum += least_[i];
    return std::max(0.0, sum / piece_.corners);
  }

 private:
  /// Returns the values of the distance from the plane that touches t and has the unit vector `normal`.
  Values values(const Corners& t, const dvec3& normal) const {
    const double at_centroid = gap(centroid_, t, normal);
    Values result{};
    for (int i = 0; i < piece_.corners; ++i) {
      result[i] = at_centroid + glm::dot(normal, piece_.corner[i] - centroid_);
    }
    return result;
  }

  /// Returns by how much `least_` would fall.
  double loss(const Values& v) const {
    double sum = 0;
    for (int i = 0; i < piece_.corners; ++i) sum += std::max(0.0, least_[i] - v[i]);
    return sum;
  }

  const Simplex& piece_;
  dvec3 centroid_, apart_;
  Values least_;
};

/// Widens the ranges by the rounding of their arithmetic.
DistanceBounds rounded_outwards(DistanceBounds bounds) {
  const double square = kRounding * (2 * bounds.mean.upper + kRounding);
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

  if (r <= kShort * d) {
    bounds.value = bounds.mean = {d - r, d + r};
    bounds.mean_square = {(d - r) * (d - r), (d + r) * (d + r)};
    return rounded_outwards(bounds);
  }

  Below below(piece, c, corners(b, nearest.triangle), nearest.point);
  int seen = 0;
  const std::size_t nodes = hierarchy.for_each_within(c, d + 2 * r, [&](std::uint32_t i) {
    if (++seen > kMostTriangles) return false;
    below.add(corners(b, i));
    return true;
  });
  bounds.steps += std::uint32_t(nodes) + std::uint32_t(seen);
  if (seen <= kMostTriangles) {
    bounds.value.lower = below.least();
    bounds.mean.lower = below.mean();
  } else {
    double least = std::numeric_limits<double>::infinity(), sum = 0;
    for (int i = 0; i < k; ++i) {
      const Hierarchy::Nearest corner =
          hierarchy.nearest(piece.corner[i], std::numeric_limits<double>::infinity(), nearest.triangle);
      const double at = corner.distance;
      bounds.steps += corner.nodes;
      least = std::min(least, at * at);
      sum += at * at / k;
    }
    bounds.value.lower = std::max(d - r, std::sqrt(std::max(0.0, least - r * r)));
    bounds.value.lower = std::max(0.0, bounds.value.lower);
    bounds.mean_square.lower = std::max(0.0, sum - spread / (k + 1));
    // This holds because d = d^2 / d, and d is nowhere larger than value.upper.
    bounds.mean.lower = std::max(bounds.value.lower, bounds.mean_square.lower / bounds.value.upper);
  }
  bounds.mean_square.lower = std::max(bounds.mean_square.lower, bounds.mean.lower * bounds.mean.lower);
  return rounded_outwards(bounds);
}

DistanceBounds bounds_around(const dvec3& point, const Hierarchy::Nearest& nearest, const Simplex& piece,
                             const TriangleMesh& b) {
  DistanceBounds bounds = above(piece, b, nearest.triangle);
  double r = 0;
  for (int i = 0; i < piece.corners; ++i) r = std::max(r, glm::distance(piece.corner[i], point));
  bounds.value.lower = bounds.mean.lower = std::max(0.0, nearest.distance - r);
  bounds.mean_square.lower = bounds.mean.lower * bounds.mean.lower;
  return rounded_outwards(bounds);
}

}  // namespace tolvol
