// SPDX-License-Identifier: GPL-3.0-or-later
// Every change may add to the bound. A change takes no more than a fixed share of the room that is left, so that room
// is left after many changes, and no more than it needs, which on a plane is next to nothing.
#include "decimation/replaced_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tolvol {
namespace {

/// The share of the room left below the limit that one change may take.
constexpr double kStep = 1.0 / 32;
/// The share of a step that the search looks for; the rest is room for rounding.
constexpr double kLookedFor = 0.5;
/// A step of a smaller share of the tolerance is not taken.
constexpr double kLeast = 1e-6;
/// A part is cut only where both sides are strips of at least this width, a share of the distance that is looked for.
constexpr double kWorthCutting = 0.25;
/// A part that is shorter than this share of the distance that is looked for is not split further.
constexpr double kFloor = 0.1;
/// The number of parts that a search looks at before it gives up.
constexpr std::size_t kMostParts = 512;

}  // namespace

void ReplacedFaces::add(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double distance) {
  faces_.emplace_back(a, b, c);
  farthest_ = std::max(farthest_, distance);
}

double ReplacedFaces::bound(const glm::dvec3 (&corners)[3], double limit) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double step = kStep * (limit - farthest_);
  const double near = kLookedFor * step, near2 = near * near, rounding = witness_error(2 * (1 + limit));
  if (!(step >= kLeast * limit && near + rounding <= step)) return kNone;
  double used2 = 0;
  parts_.assign(1, {{corners[0], corners[1], corners[2]}});
  for (std::size_t looked = 0; !parts_.empty(); ++looked) {
    if (looked == kMostParts) return kNone;
    const Part part = parts_.back();
    parts_.pop_back();
    const auto& [a, b, c] = part.corners;
    FourPoints points;
    points.set(a, b, c, (a + b + c) * (1.0 / 3));
    double centre2 = kNone;
    const WitnessTriangle* below = nullptr;  // The face nearest to the centre.
    double least2 = near2;                   // The square of how far the corners are from one face at most.
    bool covered = false;
    for (const WitnessTriangle& face : faces_) {
      double d2[4];
      witness_distances(face, points, d2);
      if (d2[3] < centre2) centre2 = d2[3], below = &face;
      // The comparisons are written so that NaN is not covered.
      if (d2[0] <= least2 && d2[1] <= least2 && d2[2] <= least2) {
        least2 = std::max({d2[0], d2[1], d2[2]});
        covered = true;
      }
    }
    if (covered) {
      used2 = std::max(used2, least2);
      continue;
    }
    // The comparison is written so that NaN ends here.
    if (!(centre2 <= near2) || longest_squared(part) <= kFloor * kFloor * near2 || part.cuts == kMostCuts) return kNone;
    if (!cut(part, *below, kWorthCutting * near, parts_)) split(part, parts_);
  }
  return farthest_ + std::sqrt(used2) + rounding;
}

}  // namespace tolvol
