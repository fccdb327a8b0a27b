// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/segment_cover.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/call.h"
#include "geometry/closest_point.h"

namespace tolvol {
namespace {

constexpr std::size_t kMostIntervals = 1 << 20;
// After this many halvings the end of an interval is known as well as double precision can hold it.
constexpr int kHalvings = 60;

}  // namespace

bool covers_segment(const Witnesses& triangles, const Hierarchy& hierarchy, const glm::dvec3& a, const glm::dvec3& b,
                    double limit) {
  const double reach = limit + kCoverShare * witness_error(1 + 2 * limit), reach2 = reach * reach;
  // A point is placed from the nearer end, which errs less and is exact at both ends.
  const auto at = [&](double t) { return t <= 0.5 ? a + t * (b - a) : b + (1 - t) * (a - b); };
  const auto covered = [&](const WitnessTriangle& triangle, double t) {
    return closest_point(at(t), triangle.a, triangle.a + triangle.ab, triangle.a + triangle.ac).distance_squared <=
           reach2;
  };
  double begin = 0;
  for (std::size_t interval = 0; interval < kMostIntervals; ++interval) {
    if (interval % 64 == 0) poll();
    double end = -1;
    // The search computes distances in another way. The radius is a little larger, so that it misses no triangle.
    hierarchy.for_each_within(at(begin), reach * (1 + 1e-12), [&](std::uint32_t i) {
      const WitnessTriangle triangle = triangles[i];
      if ((end >= 0 && !covered(triangle, end)) || !covered(triangle, begin)) return true;
      if (covered(triangle, 1)) {
        end = 1;
        return false;
      }
      double beyond = 1;
      end = std::max(begin, end);
      for (int k = 0; k < kHalvings; ++k) {
        const double middle = 0.5 * (end + beyond);
        (covered(triangle, middle) ? end : beyond) = middle;
      }
      return true;
    });
    if (end == 1) return true;
    if (!(end > begin)) return false;
    begin = end;
  }
  return false;
}

}  // namespace tolvol
