// SPDX-License-Identifier: GPL-3.0-or-later
// Every change may add to the bound. A change takes no more than a fixed share of the room that is left, so that room
// is left after many changes, and no more than it needs, which on a plane is next to nothing.
//
// Around a vertex with hundreds of faces a triangle is cut into hundreds of parts, each near a few of the faces. So a
// part inherits the faces that may be near the part that it was cut from. Faces that are left out could not have
// covered it, so that the bound is the same bits.
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
/// After so many comparisons of parts with faces no further search begins: where hundreds of faces move, each of which
/// lies along hundreds of those that they replace, their number grows with the square, and the reference knows sooner.
constexpr std::size_t kMostComparisons = std::size_t{1} << 18;
/// A list of no more faces than this is not worth shortening.
constexpr std::size_t kFew = 8;

}  // namespace

void ReplacedFaces::add(const glm::dvec3 (&corners)[3], const FaceBound& bound,
                        const std::optional<glm::dvec3>& normal) {
  faces_.emplace_back(corners[0], corners[1], corners[2]);
  normals_.push_back(normal);
  angles_.push_back(bound.angle);
  farthest_ = std::max(farthest_, bound.distance);
}

/// Gives the part a list without the faces of its list that are farther than `within` from all of it, as a plane across
/// one of their edges shows.
void ReplacedFaces::keep_near(Part& part, double within) {
  const List of = lists_[part.of];
  if (of.end - of.begin <= kFew) return;
  if (outlines_.empty()) {
    for (const WitnessTriangle& face : faces_) {
      Outline& o = outlines_.emplace_back(Outline{{face.gs, face.gt, -face.gs - face.gt}, {}, {}});
      for (int k = 0; k < 3; ++k) {
        o.length[k] = glm::length(o.inwards[k]);
        o.least[k] = std::min({0.0, glm::dot(o.inwards[k], face.ab), glm::dot(o.inwards[k], face.ac)});
      }
    }
  }
  const std::size_t begin = near_.size();
  for (std::size_t i = of.begin; i < of.end; ++i) {
    const std::uint32_t f = near_[i];
    const Outline& o = outlines_[f];
    bool is_far = false;
    for (int k = 0; k < 3 && !is_far; ++k) {
      double most = -std::numeric_limits<double>::infinity();
      for (const glm::dvec3& p : part.corners) most = std::max(most, glm::dot(o.inwards[k], p - faces_[f].a));
      is_far = o.least[k] - most > within * o.length[k];
    }
    if (!is_far) near_.push_back(f);
  }
  part.of = static_cast<std::uint32_t>(lists_.size());
  lists_.push_back({begin, near_.size()});
}

FaceBound ReplacedFaces::bound(const glm::dvec3 (&corners)[3], double limit, const Facing* facing) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double step = kStep * (limit - farthest_);
  const double near = kLookedFor * step, near2 = near * near, rounding = witness_error(2 * (1 + limit));
  if (!(step >= kLeast * limit && near + rounding <= step) || looked_at_ > kMostComparisons) return {};
  turned_.assign(faces_.size(), facing ? std::numbers::pi : 0);
  for (std::size_t i = 0; facing && i < faces_.size(); ++i) {
    if (normals_[i]) turned_[i] = angles_[i] + angle_bound(glm::dot(*normals_[i], facing->normal()));
  }
  double used2 = 0, used_angle = facing ? 0 : std::numbers::pi;
  parts_.assign(1, {{corners[0], corners[1], corners[2]}});
  near_.clear();
  for (std::uint32_t i = 0; i < faces_.size(); ++i) {
    if (!facing || turned_[i] <= facing->limit()) near_.push_back(i);
  }
  lists_.assign(1, {0, near_.size()});
  for (std::size_t looked = 0; !parts_.empty(); ++looked) {
    if (looked == kMostParts) return {};
    Part part = parts_.back();
    parts_.pop_back();
    const auto& [a, b, c] = part.corners;
    FourPoints points;
    points.set(a, b, c, (a + b + c) * (1.0 / 3));
    double centre2 = kNone;
    const WitnessTriangle* below = nullptr;  // The face nearest to the centre.
    double least2 = near2;                   // The square of how far the corners are from one face at most.
    bool covered = false;
    double angle = 0;  // Of the face that covers the part.
    const List near_part = lists_[part.of];
    looked_at_ += near_part.end - near_part.begin;
    for (std::size_t k = near_part.begin; k < near_part.end; ++k) {
      const std::uint32_t i = near_[k];
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
    keep_near(part, near + rounding);
    if (!cut(part, *below, kWorthCutting * near, parts_)) split(part, parts_);
  }
  return {farthest_ + std::sqrt(used2) + rounding, used_angle};
}

}  // namespace tolvol
