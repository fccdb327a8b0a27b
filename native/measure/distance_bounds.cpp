// SPDX-License-Identifier: GPL-3.0-or-later
// Let c be the centroid of the piece, p_i its corners, r the largest |p_i - c| and d(x) the distance to b.
//
// - Above. The distance to the triangle T nearest to c is convex, and so is its square: over the piece they are at most
//   the largest of their values at the corners, and on average at most the mean of these. d is nowhere larger.
// - Below. The triangle nearest to any point of the piece is within d(c) + 2 r of c. For each such triangle there are
//   linear functions that its distance nowhere falls below, one for each plane that separates it from c; the least of
//   one such function for each triangle is concave, so that over the piece it is at least the least of its values at
//   the corners, and on average at least their mean. Two planes are tried: the one at the point nearest to c, and the
//   one parallel to that of T, without which the triangles beside T would seem to come nearer.
// - Below, where that is too many triangles, because the surfaces are far apart for their size: for x = sum w_i p_i and
//   every y, |x - y|^2 = sum w_i |p_i - y|^2 - sum w_i |p_i - x|^2 (Lagrange), hence d(x)^2 >= sum w_i d(p_i)^2 -
//   sum w_i |p_i - x|^2. For k corners the last term is at most r^2, and sum |p_i - c|^2 / (k + 1) on average.
//
// Rounding. u = 2^-53; every point has |x| <= 1. The distance from a point to the witness on T exceeds the true
// distance to the mesh by nothing and falls short of the distance to T by at most 20 u (measure/hausdorff.cpp derives
// it). A plane never takes its offset from a distance: a short difference has the direction of its rounding, and T may
// reach far to the other side of a plane that is turned by it. The offset is the least over the corners of T, which
// errs by 16 u whatever the direction is, and by 8 u more at a corner of the piece. Placing both meshes errs by 2 u,
// the centroid and the mean of the corners by 4 u each. kRounding is above the sum, so that both ends lie outside of
// it.
#include "measure/distance_bounds.h"

#include <algorithm>
#include <cmath>

#include "geometry/frame.h"

namespace tolvol {
namespace {

using glm::dvec3;
using Values = std::array<double, 3>;  // at the corners of a piece

// Triangles whose planes are worth asking for: more of them cost more than another four pieces.
constexpr int kMostTriangles = 64;
// Of the distance: a piece that is so short is known well enough by one point, as nothing changes faster than one to
// one.
constexpr double kShort = 1e-4;
constexpr double kRounding = 64 * kUnitRoundoff;  // derived above

using Corners = std::array<dvec3, 3>;

dvec3 direction(const dvec3& v) {
  const double length = glm::length(v);
  return length < 1e-150 ? dvec3(0) : v / length;  // the square of a shorter one has lost its bits
}

/// How far p is on the side that `normal`, of length 1 or 0, points to from all of t; below 0 where it is not.
double gap(const dvec3& p, const Corners& t, const dvec3& normal) {
  return std::min({glm::dot(normal, p - t[0]), glm::dot(normal, p - t[1]), glm::dot(normal, p - t[2])});
}

/// The normal of the plane that separates p from t best: of the one at `nearest`, the point of t nearest to p, and of
/// the one parallel to t, which stays sharp where p is within rounding of t.
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

/// The upper ends, from the distances of the corners to one triangle of b.
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

/// At each corner of a piece the least value of linear functions as above, one for each triangle.
class Below {
 public:
  /// `nearest`: the point of t, the triangle nearest to the centroid, that is nearest to it.
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
  /// Of the distance from the plane that touches t and has the unit vector `normal`.
  Values values(const Corners& t, const dvec3& normal) const {
    const double at_centroid = gap(centroid_, t, normal);
    Values result{};
    for (int i = 0; i < piece_.corners; ++i) {
      result[i] = at_centroid + glm::dot(normal, piece_.corner[i] - centroid_);
    }
    return result;
  }

  /// By how much `least_` would fall.
  double loss(const Values& v) const {
    double sum = 0;
    for (int i = 0; i < piece_.corners; ++i) sum += std::max(0.0, least_[i] - v[i]);
    return sum;
  }

  const Simplex& piece_;
  dvec3 centroid_, apart_;
  Values least_;
};

/// The ranges with what their arithmetic may be off by.
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
    // d = d^2 / d, and d is nowhere larger than value.upper.
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
