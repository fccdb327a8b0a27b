// SPDX-License-Identifier: GPL-3.0-or-later
// Every change may add to the bound. A change takes no more than a fixed share of the room that is left, so that room
// is left after many changes, and no more than it needs, which on a plane is next to nothing.
#include "decimation/replaced_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

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

void ReplacedFaces::add(const glm::dvec3 (&corners)[3], const FaceBound& bound,
                        const std::optional<glm::dvec3>& normal) {
  faces_.emplace_back(corners[0], corners[1], corners[2]);
  normals_.push_back(normal);
  angles_.push_back(bound.angle);
  farthest_ = std::max(farthest_, bound.distance);
}

FaceBound ReplacedFaces::bound(const glm::dvec3 (&corners)[3], double limit, const Facing* facing) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double step = kStep * (limit - farthest_);
  const double near = kLookedFor * step, near2 = near * near, rounding = witness_error(2 * (1 + limit));
  if (!(step >= kLeast * limit && near + rounding <= step)) return {};
  turned_.assign(faces_.size(), facing ? std::numbers::pi : 0);
  for (std::size_t i = 0; facing && i < faces_.size(); ++i) {
    if (normals_[i]) turned_[i] = angles_[i] + angle_bound(glm::dot(*normals_[i], facing->normal()));
  }
  double used2 = 0, used_angle = facing ? 0 : std::numbers::pi;
  parts_.assign(1, {{corners[0], corners[1], corners[2]}});
  for (std::size_t looked = 0; !parts_.empty(); ++looked) {
    if (looked == kMostParts) return {};
    const Part part = parts_.back();
    parts_.pop_back();
    const auto& [a, b, c] = part.corners;
    FourPoints points;
    points.set(a, b, c, (a + b + c) * (1.0 / 3));
    double centre2 = kNone;
    const WitnessTriangle* below = nullptr;  // The face nearest to the centre.
    double least2 = near2;                   // The square of how far the corners are from one face at most.
    bool covered = false;
    double angle = 0;  // Of the face that covers the part.
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      if (facing && !(turned_[i] <= facing->limit())) continue;
      double d2[4];
      witness_distances(faces_[i], points, d2);
      if (d2[3] < centre2) centre2 = d2[3], below = &faces_[i];
      // The comparisons are written so that NaN is not covered.
      if (d2[0] <= least2 && d2[1] <= least2 && d2[2] <= least2) {
        least2 = std::max({d2[0], d2[1], d2[2]});
        covered = true, angle = turned_[i];
      }
    }
    if (covered) {
      used2 = std::max(used2, least2), used_angle = std::max(used_angle, angle);
      continue;
    }
    // The comparison is written so that NaN ends here.
    if (!(centre2 <= near2) || longest_squared(part) <= kFloor * kFloor * near2 || part.cuts == kMostCuts) return {};
    if (!cut(part, *below, kWorthCutting * near, parts_)) split(part, parts_);
  }
  return {farthest_ + std::sqrt(used2) + rounding, used_angle};
}

}  // namespace tolvol
