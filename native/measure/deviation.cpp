// SPDX-License-Identifier: GPL-3.0-or-later
// Every statistic is one of a distribution by area. The distances at the points of the pieces give the estimate, and
// the lower and the upper bounds of the pieces give the ends of its range. In the mean the distance at a point is
// corrected by what is known about its piece: by the mean of a linear function between the bounds, less the value of
// the function at the point.
//
// The bounds of a piece include their own rounding, and leave more room between them than the error of the sums of
// weighted bounds. Weights are added in another order for each distribution, so that equal shares may differ in the
// last bits. If the ends of a range depend on shares alone, kShareRounding is between them.
#include "measure/deviation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <sstream>
#include <utility>

#include "base/call.h"
#include "measure/distribution.h"
#include "measure/placed_pair.h"
#include "measure/sampled_surface.h"

namespace tolvol {
namespace {

// A bound over a piece is a linear function. It enters the distributions by its values on kSlices equal shares of the
// piece, as many as DistanceBounds has quarters.
constexpr int kSlices = 4;
// Rounding changes a share by at most so much.
constexpr double kShareRounding = 32 * kUnitRoundoff;

/// Returns the number that the linear function with these values at the corners does not exceed on `share` of a piece.
double quantile(std::array<double, 3> value, int corners, double share) {
  if (corners == kLength && value[1] < value[0]) std::swap(value[0], value[1]);
  if (corners == kArea) std::sort(value.begin(), value.end());
  const auto [a, b, c] = value;
  if (corners == kNumber) return a;
  if (corners == kLength) return a + share * (b - a);
  if (share * (c - a) <= b - a) return a + std::sqrt(share * (b - a) * (c - a));
  return c - std::sqrt((1 - share) * (c - a) * (c - b));
}

/// Values of a bound over equal shares of a piece.
using Slices = std::array<double, kSlices>;

double sum_of(const Slices& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

/// visit(piece, add) calls add(number, share of the piece) for the parts of a piece.
template <class Visit>
Distribution distribution_of(const std::vector<SampledPiece>& pieces, Visit&& visit) {
  std::vector<Distribution::Part> parts;
  for (const SampledPiece& piece : pieces) {
    poll_at(parts.size());
    if (!(piece.weight > 0)) continue;
    visit(piece, [&](double number, double share) { parts.push_back({number, share * piece.weight}); });
  }
  return Distribution(std::move(parts));
}

Estimate estimate(double value, double lower, double upper) {
  return {std::clamp(value, lower, upper), {lower, upper}};
}

/// Widens a share by rounding. The shares 0 and 1 are not sums, and stay as they are.
Estimate estimated_share(double value, double lower, double upper) {
  if (lower < 1) lower = std::max(0.0, lower - kShareRounding);
  if (upper > 0) upper = std::min(1.0, upper + kShareRounding);
  return estimate(value, lower, upper);
}

/// Returns the sides in the frame.
Sides sides_of(const std::vector<SampledPiece>& pieces) {
  Sum weight, mean, mean_lower, mean_upper, inside, inside_lower, inside_upper;
  Sides sides;
  for (const SampledPiece& piece : pieces) {
    const Range &value = piece.bounds.value, &average = piece.bounds.mean;
    // A piece whose distance is nowhere 0 is on one side.
    const bool crosses = !(value.lower > 0);
    weight.add(piece.weight);
    // Where the distance is nowhere 0 it has one sign.
    mean.add(piece.weight * (crosses ? piece.signed_distance() : piece.signed_average()));
    mean_lower.add(piece.weight * (crosses || piece.inside ? -average.upper : average.lower));
    mean_upper.add(piece.weight * (crosses || !piece.inside ? average.upper : -average.lower));
    inside.add(piece.inside ? piece.weight : 0);
    inside_lower.add(piece.inside && !crosses ? piece.weight : 0);
    inside_upper.add(piece.inside || crosses ? piece.weight : 0);
    Range& own = piece.inside ? sides.inside : sides.outside;
    own.lower = std::max(own.lower, piece.distance);
    if (crosses || piece.inside) sides.inside.upper = std::max(sides.inside.upper, value.upper);
    if (crosses || !piece.inside) sides.outside.upper = std::max(sides.outside.upper, value.upper);
  }
  const double whole = weight.value();
  sides.mean = estimate(mean.value() / whole, mean_lower.value() / whole, mean_upper.value() / whole);
  sides.share_inside =
      estimated_share(inside.value() / whole, inside_lower.value() / whole, inside_upper.value() / whole);
  return sides;
}

void require(bool good, const char* what, std::size_t i, const char* is_not) {
  if (good) return;
  std::ostringstream text;
  text << what << ' ' << i << " is not " << is_not;
  throw InvalidInput(text.str());
}

}  // namespace

Deviation deviation(const TriangleMesh& a, const TriangleMesh& b, const DeviationOptions& options) {
  for (std::size_t i = 0; i < options.bounds.size(); ++i) {
    require(options.bounds[i] >= 0, "bound", i, "a length of 0 or more");
  }
  for (std::size_t i = 0; i < options.percentiles.size(); ++i) {
    require(options.percentiles[i] >= 0 && options.percentiles[i] <= 100, "percentile", i, "between 0 and 100");
  }
  const Call call(options.progress);
  if (options.progress) options.progress->begin("averaging");
  const PlacedPair pair(a, b);
  const double scale = pair.frame.scale();
  SampledSurface surface(pair, b, options);
  surface.measure();
  const std::vector<SampledPiece>& pieces = surface.pieces();

  Deviation result;
  Sum weight, mean, mean_lower, mean_upper, square, square_lower, square_upper, variance;
  for (const SampledPiece& piece : pieces) {
    const DistanceBounds& of = piece.bounds;
    const double d = piece.distance, width = piece.width();
    weight.add(piece.weight);
    variance.add(piece.weight * piece.weight * width * width / 4);  // is the largest variance of numbers in an interval
    mean.add(piece.weight * piece.average);
    mean_lower.add(piece.weight * of.mean.lower);
    mean_upper.add(piece.weight * of.mean.upper);
    square.add(piece.weight * d * d);
    square_lower.add(piece.weight * of.mean_square.lower);
    square_upper.add(piece.weight * of.mean_square.upper);
  }
  const double whole = weight.value();
  const auto average = [&](const Sum& sum) { return sum.value() / whole / scale; };
  const auto root = [&](const Sum& sum) { return std::sqrt(sum.value() / whole) / scale; };
  result.mean = estimate(average(mean), average(mean_lower), average(mean_upper));
  result.rms = estimate(root(square), root(square_lower), root(square_upper));

  result.mean_error = std::sqrt(variance.value()) / whole / scale;

  const Distribution seen =
      distribution_of(pieces, [](const SampledPiece& piece, auto&& add) { add(piece.distance, 1); });
  const Distribution least = distribution_of(pieces, [](const SampledPiece& piece, auto&& add) {
    Slices linear, quarters;
    for (int i = 0; i < kSlices; ++i) {
      linear[i] = quantile(piece.bounds.lower, piece.simplex.corners, double(i) / kSlices) - kRangeNoise;
      quarters[i] = piece.bounds.quarters[i].lower;
    }
    const Slices& better = sum_of(linear) > sum_of(quarters) ? linear : quarters;
    for (const double at : better) add(std::max(piece.bounds.value.lower, at), 1.0 / kSlices);
  });
  const Distribution most = distribution_of(pieces, [](const SampledPiece& piece, auto&& add) {
    Slices linear, quarters;
    for (int i = 0; i < kSlices; ++i) {
      linear[i] = quantile(piece.bounds.upper, piece.simplex.corners, double(i + 1) / kSlices) + kRangeNoise;
      quarters[i] = piece.bounds.quarters[i].upper;
    }
    const Slices& better = sum_of(linear) < sum_of(quarters) ? linear : quarters;
    for (const double at : better) add(std::min(piece.bounds.value.upper, at), 1.0 / kSlices);
  });
  for (const double bound : options.bounds) {
    const double t = bound * scale;
    result.share_beyond.push_back(estimated_share(seen.share_beyond(t), least.share_beyond(t), most.share_beyond(t)));
  }
  for (const double p : options.percentiles) {
    result.percentiles.push_back(estimate(seen.percentile(p) / scale, least.percentile(p, -kShareRounding) / scale,
                                          most.percentile(p, kShareRounding) / scale));
  }
  if (surface.has_sides()) {
    Sides& sides = result.sides.emplace(sides_of(pieces));
    for (double* length : {&sides.mean.value, &sides.mean.range.lower, &sides.mean.range.upper, &sides.inside.lower,
                           &sides.inside.upper, &sides.outside.lower, &sides.outside.upper}) {
      *length /= scale;
    }
  }
  for (const SampledPiece& piece : pieces) {
    poll_at(result.distances.size());
    result.distances.push_back(piece.signed_distance() / scale);
    result.weights.push_back(piece.weight / whole);
  }
  result.spacing = surface.spacing() / scale;
  result.steps = surface.steps();
  if (options.progress) options.progress->update(1);
  return result;
}

}  // namespace tolvol
