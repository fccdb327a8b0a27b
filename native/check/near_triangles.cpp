// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/near_triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/call.h"
#include "geometry/closest_point.h"

namespace tolvol {
namespace {

// A piece gets its first list after this many searches, if they have visited this many nodes each on average. Most
// pieces of a fine mesh need fewer searches, and where a search visits fewer nodes it costs less than a list.
constexpr std::size_t kSearches = 8, kNodesOfSearch = 64;
// A list has at most this many triangles. If a part has more, its own parts try again.
constexpr std::size_t kLongest = 256;
// A visit of a node takes as long as a look at so many triangles of a list.
constexpr std::size_t kListedAtNode = 4;
// The lists of a piece hold at most this many triangles, in 16 MiB. After that a part keeps the list that it inherits.
constexpr std::size_t kMostKept = 1 << 22;
// A piece polls after this many nodes, as a search does.
constexpr std::size_t kNodesBetweenPolls = 1024;
// If two distances in the frame differ by less than this, the hierarchy decides. This is more than a thousand times the
// rounding here and in the hierarchy, whose corners may differ from those of the witnesses in the last bits.
constexpr double kAsNear = 0x1p-40;
constexpr double kNothing = std::numeric_limits<double>::infinity();

}  // namespace

void NearTriangles::begin(const Witnesses& triangles, const Hierarchy& hierarchy, double radius, const Facing* facing,
                          std::size_t* steps) {
  triangles_ = triangles, hierarchy_ = &hierarchy, facing_ = facing, steps_ = steps, radius_ = radius;
  searches_ = nodes_ = 0, too_far_ = kNothing;
  pool_.clear();
  lists_.assign(1, {0, 0});
}

std::uint32_t NearTriangles::nearest(Part& part, const glm::dvec3& centre, double radius, std::uint32_t hint,
                                     const FacingRule::Enough& enough) {
  if (part.of != 0) {
    narrow(part, centre);
  } else if (searches_ < kSearches || nodes_ < kNodesOfSearch * searches_ || !gather(part, centre)) {
    return search(centre, radius, hint, enough);
  }
  if (best_ == Hierarchy::kNone) return Hierarchy::kNone;
  const double best = std::sqrt(best2_);
  if (std::abs(best - radius) < kAsNear || std::sqrt(second2_) - best < kAsNear) {
    return search(centre, radius, hint, enough);
  }
  return best <= radius ? best_ : Hierarchy::kNone;
}

std::uint32_t NearTriangles::search(const glm::dvec3& centre, double radius, std::uint32_t hint,
                                    const FacingRule::Enough& enough) {
  ++searches_;
  const Hierarchy::Nearest found =
      facing_ ? facing_->nearest(*hierarchy_, centre, radius, hint, enough) : hierarchy_->nearest(centre, radius, hint);
  if (steps_) *steps_ += found.nodes;
  // Where nothing is near, a list costs nothing.
  const std::size_t before = nodes_;
  nodes_ += found.triangle == Hierarchy::kNone ? kNodesOfSearch : found.nodes;
  if (nodes_ / kNodesBetweenPolls != before / kNodesBetweenPolls) poll();
  return found.triangle;
}

/// Returns a distance: a triangle within the radius of some point of the part is within this distance of its centre.
double NearTriangles::reach(const Part& part, const glm::dvec3& centre) const {
  double farthest2 = 0;
  for (const glm::dvec3& corner : part.corners) {
    farthest2 = std::max(farthest2, glm::dot(corner - centre, corner - centre));
  }
  return radius_ + std::sqrt(farthest2) + kAsNear;
}

void NearTriangles::look_at(std::uint32_t triangle, const glm::dvec3& centre, double reach2) {
  const auto [a, b, c] = triangles_->corners(triangle);
  if (is_beyond(centre, a, b, c, reach2)) return;
  const double squared = closest_point(centre, a, b, c).distance_squared;
  if (squared > reach2) return;
  pool_.push_back(triangle);
  if (squared < best2_) {
    second2_ = best2_, best2_ = squared, best_ = triangle;
  } else {
    second2_ = std::min(second2_, squared);
  }
}

/// Makes a list from the hierarchy. Returns false if the list is too long, or was too long for a part hardly larger.
bool NearTriangles::gather(Part& part, const glm::dvec3& centre) {
  const double reach = this->reach(part, centre), reach2 = reach * reach;
  const std::size_t begin = pool_.size();
  if (!(2 * reach <= too_far_) || begin >= kMostKept) return false;
  best2_ = second2_ = kNothing, best_ = Hierarchy::kNone;
  const auto visit = [&](std::uint32_t triangle) {
    if (facing_ && !facing_->admits(triangle)) return true;
    look_at(triangle, centre, reach2);
    return pool_.size() - begin <= kLongest;
  };
  const std::size_t visited = hierarchy_->for_each_within(
      centre, reach, visit, [&](std::uint32_t node) { return !facing_ || facing_->may_admit(node); });
  if (steps_) *steps_ += visited;
  if (pool_.size() - begin > kLongest) {
    pool_.resize(begin);
    too_far_ = reach;
    return false;
  }
  part.of = static_cast<std::uint32_t>(lists_.size());
  lists_.push_back({begin, pool_.size()});
  return true;
}

/// Makes a list from the list that the part has.
void NearTriangles::narrow(Part& part, const glm::dvec3& centre) {
  const double reach = this->reach(part, centre), reach2 = reach * reach;
  const List from = lists_[part.of];
  const std::size_t begin = pool_.size(), length = from.end - from.begin;
  best2_ = second2_ = kNothing, best_ = Hierarchy::kNone;
  for (std::size_t i = from.begin; i < from.end; ++i) look_at(pool_[i], centre, reach2);
  if (steps_) *steps_ += length / kListedAtNode;
  if (pool_.size() - begin == length || pool_.size() > kMostKept) {
    pool_.resize(begin);
    return;
  }
  part.of = static_cast<std::uint32_t>(lists_.size());
  lists_.push_back({begin, pool_.size()});
}

}  // namespace tolvol
