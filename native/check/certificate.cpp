// SPDX-License-Identifier: GPL-3.0-or-later
// A search tries the cheapest reason first: short edges between corners that are known to be near; the triangle of the
// grid node nearest to the piece's centre; the triangles of the nodes around the centre; the exact closest triangle by
// the hierarchy, which also proves "outside". Then it cuts the piece along an edge of a triangle, or splits it. It
// looks at the parts breadth first, because the centres of large parts show soonest that a piece is outside.
#include "check/certificate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/facing.h"
#include "check/near_triangles.h"
#include "check/part.h"
#include "check/segment_cover.h"
#include "geometry/closest_point.h"
#include "geometry/lengths.h"

namespace tolvol {
namespace {

// All lengths and distances among these constants are in tolerances.
// A part this short is not split further, because the headroom that operations leave is enough for shorter parts.
constexpr double kFloor = kHeadroom;
// A quick search does not split a part this short.
constexpr double kQuickFloor = 0.02;
// A part is cut along an edge only if both sides are at least this wide.
constexpr double kWorthCutting = 0.25;
// A search for a verdict looks at this many parts before it leaves the piece unproved.
constexpr std::size_t kBudget = 1 << 20;
// A search looks at this many parts if it is only one of many tries.
constexpr std::size_t kQuickBudget = 1 << 13;
// A part takes as long as the visit of so many nodes.
constexpr std::size_t kStepsOfPart = 2;
// A search polls after this many parts.
constexpr std::size_t kBetweenPolls = 256;
// Probes of a triangle are this far apart along its longest edge.
constexpr double kProbeSpacing = 2.0;
// Probes divide an edge into at most this many steps.
constexpr int kMostProbes = 8;
// Where nodes are farther apart than this, their triangles are too far from the point nearest to a place between them:
// decimation left a tenth more faces. With a search in their place it takes up to a third longer.
constexpr double kCoarse = 3.0;
// A piece shorter than this is tried against the triangles of all eight nodes around its centre.
constexpr double kSmall = 2.0;
// A piece longer than this over small triangles is split at once.
constexpr double kLong = 1.9;
// A piece shorter than this is worth an exact search.
constexpr double kExact = 0.7;
// Among needles, once so many searches in a row were in vain, a piece goes on without them. They are for long parts
// that no node helps to cut.
constexpr int kSearchesInVain = 4;
// bound_with_room() tries to leave this much of the tolerance.
constexpr double kRoomToLeave = 1.0 / 32;
// The grid's guess of a distance is used without a search up to this distance.
constexpr double kRoom = 0.7;
// In the frame, more than witness_error(), by which a proof may reach a point that is beyond the limit: 2^-40 is 16
// times witness_error(1).
constexpr double kBeyondRounding = 0x1p-40;

bool comes_first(const glm::dvec3& p, const glm::dvec3& q) {
  if (p.x != q.x) return p.x < q.x;
  return p.y != q.y ? p.y < q.y : p.z < q.z;
}

/// Holds the corners in an order that follows from their positions alone. It holds a segment as (a, b, b).
struct Ordered {
  Ordered(const glm::dvec3 (&from)[3], const glm::uvec3& hints_from) {
    const int second = comes_first(from[1], from[0]), third = comes_first(from[2], from[0]),
              last = comes_first(from[2], from[1]);
    const int place[3] = {second + third, 1 - second + last, 2 - third - last};
    for (int i = 0; i < 3; ++i) corners[place[i]] = from[i], hints[place[i]] = hints_from[i];
    if (corners[0] == corners[1]) corners[1] = corners[2], hints[1] = hints[2];
  }
  glm::dvec3 corners[3];
  glm::uvec3 hints;
};

}  // namespace

TriangleCertificate::TriangleCertificate(const Witnesses& reference, const DistanceGrid& grid,
                                         const Hierarchy& hierarchy, double limit, double beyond)
    : reference_(reference),
      grid_(&grid),
      hierarchy_(&hierarchy),
      limit_(limit),
      limit2_(limit * limit),
      beyond_(beyond) {}

TriangleCertificate::PointBound TriangleCertificate::point_bound(const glm::dvec3& p) const {
  const std::uint32_t triangle = grid_->triangle_near(p);
  if (triangle == DistanceGrid::kNone) {
    if (!grid_->contains(p)) return {};
    const Hierarchy::Nearest nearest = hierarchy_->nearest(p, limit_);
    return {nearest.distance, nearest.triangle};
  }
  FourPoints points;
  points.set(p, p, p, p);
  double d2[4];
  witness_distances(reference_[triangle], points, d2);
  const double guessed = std::sqrt(d2[0]);
  if (guessed <= limit_) return {guessed, triangle};
  // The triangle of the nearest node need not be that of the point, least of all where the grid is coarse.
  const Hierarchy::Nearest nearest = hierarchy_->nearest(p, limit_, triangle);
  return nearest.triangle == Hierarchy::kNone ? PointBound{guessed, triangle}
                                              : PointBound{nearest.distance, nearest.triangle};
}

bool TriangleCertificate::leaves_room(double distance) const { return distance <= kRoom * limit_; }

TriangleCertificate::PointBound TriangleCertificate::nearest(const glm::dvec3& p, double radius) const {
  const std::uint32_t guess = grid_->triangle_near(p);
  if (guess != DistanceGrid::kNone) {
    const PointBound bound = point_bound(p);
    if (leaves_room(bound.distance)) return bound;
  }
  const Hierarchy::Nearest found = hierarchy_->nearest(p, radius, guess);
  return found.triangle == Hierarchy::kNone ? PointBound{} : PointBound{found.distance, found.triangle};
}

std::optional<glm::dvec3> TriangleCertificate::nearby_point(const glm::dvec3& p) const {
  constexpr double kNear = 0.3;  // a point within this many tolerances ends the search
  if (grid_->spacing > kCoarse * limit_) {
    const Hierarchy::Nearest found =
        hierarchy_->nearest(p, std::numeric_limits<double>::infinity(), grid_->triangle_near(p));
    return found.triangle == Hierarchy::kNone ? std::nullopt : std::optional(found.point);
  }
  std::optional<glm::dvec3> nearest;
  double nearest2 = std::numeric_limits<double>::infinity();
  std::array<std::uint32_t, 8> seen;
  int count = 0;
  const glm::dvec3 cell = (p - grid_->origin) * (1 / grid_->spacing), low = glm::floor(cell);
  const glm::ivec3 first(glm::greaterThan(cell - low, glm::dvec3(0.5)));  // the eight nodes start at the nearest
  for (int i = 0; i < 8 && nearest2 > kNear * kNear * limit2_; ++i) {
    const glm::ivec3 node = glm::ivec3(low) + (first ^ glm::ivec3(i & 1, (i >> 1) & 1, i >> 2));
    if (glm::any(glm::lessThan(node, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(node, grid_->nodes))) continue;
    const std::uint32_t triangle = grid_->triangle[grid_->index(node.x, node.y, node.z)];
    if (triangle == DistanceGrid::kNone ||
        std::find(seen.begin(), seen.begin() + count, triangle) != seen.begin() + count)
      continue;
    seen[count++] = triangle;
    const auto [a, b, c] = reference_.corners(triangle);
    const ClosestPoint q = closest_point(p, a, b, c);
    if (q.distance_squared < nearest2) nearest2 = q.distance_squared, nearest = q.point;
  }
  return nearest;
}

std::optional<glm::dvec3> TriangleCertificate::nearest_point(const glm::dvec3& p, double radius,
                                                             const Facing* facing) const {
  const Hierarchy::Nearest nearest = facing ? facing->nearest(*hierarchy_, p, radius) : hierarchy_->nearest(p, radius);
  if (nearest.triangle == Hierarchy::kNone) return std::nullopt;
  const auto [a, b, c] = reference_.corners(nearest.triangle);
  return closest_point(p, a, b, c).point;
}

bool TriangleCertificate::is_open(const glm::dvec3& p, const Facing* facing, const glm::uvec3& hints) const {
  const double radius = limit_ + kBeyondRounding;
  bool is_open = true;
  const auto visit = [&](std::uint32_t triangle) {
    if (facing && !facing->admits(triangle)) return true;
    const auto [a, b, c] = reference_.corners(triangle);
    is_open = !(closest_point(p, a, b, c).distance_squared <= radius * radius);
    return is_open;
  };
  // The hints belong to the corners, which may be far from p.
  for (const std::uint32_t triangle : {grid_->triangle_near(p), hints.x, hints.y, hints.z}) {
    if (triangle != Hierarchy::kNone && !visit(triangle)) return false;
  }
  hierarchy_->for_each_within(p, radius, visit, [&](std::uint32_t node) { return !facing || facing->may_admit(node); });
  return is_open;
}

std::optional<glm::dvec3> TriangleCertificate::point_outside(const glm::dvec3 (&corners)[3], const Facing* facing,
                                                             const glm::uvec3& hints) const {
  const auto& [a, b, c] = corners;
  const double longest = std::sqrt(std::max({squared_length(b - a), squared_length(c - b), squared_length(a - c)}));
  const double wanted = std::min(longest / (kProbeSpacing * limit_), static_cast<double>(kMostProbes));
  const int n = std::max(2, static_cast<int>(wanted));
  const glm::dvec3 u = (b - a) * (1.0 / n), v = (c - a) * (1.0 / n);
  for (int i = 0; i < n; ++i) {
    for (int j = i == 0; i + j <= n && j < n; ++j) {  // this skips the corners
      const glm::dvec3 p = a + static_cast<double>(i) * u + static_cast<double>(j) * v;
      if (is_open(p, facing, hints)) return p;
    }
  }
  return std::nullopt;
}

/// Returns a bound if the edges are short and the corners are known to be near.
inline double TriangleCertificate::bound_by_corners(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds) const {
  const auto& [a, b, c] = corners;
  // Every point of a triangle is within L / sqrt(3) of a corner, L its longest edge.
  const double corner = std::max({bounds.x, bounds.y, bounds.z}), room = limit_ - corner;
  const double longest2 = std::max({squared_length(b - a), squared_length(c - b), squared_length(a - c)});
  return room > 0 && longest2 <= 3 * room * room ? corner + std::sqrt(longest2 * (1.0 / 3)) : kUnproved;
}

/// Sets `farthest` if the verdict is inside, or else `open`, if it is not null, to the centre of the last part. Adds
/// its steps to `steps`, if it is not null.
template <TriangleCertificate::Search kSearch>
Verdict TriangleCertificate::search(const glm::dvec3 (&corners)[3], const glm::uvec3& hints, Facing* facing,
                                    double& farthest, glm::dvec3* open, std::size_t* steps) const {
  constexpr bool kProve = kSearch == Search::verdict;
  thread_local std::vector<Part> queue;
  thread_local NearTriangles around;
  queue.assign(1, {{corners[0], corners[1], corners[2]}});
  const double radius = kProve ? beyond_ : limit_;
  around.begin(reference_, *hierarchy_, radius, facing, steps);
  Verdict result = Verdict::inside;
  double farthest2 = 0;  // the largest squared distance of the parts proved so far
  std::uint32_t hint = hints.x;
  const bool are_needles = hierarchy_->has_mostly_needles();
  int in_vain = 0;
  for (std::size_t next = 0; next < queue.size(); ++next) {
    if (next == (kProve ? kBudget : kQuickBudget)) return Verdict::unproved;
    if ((next + 1) % kBetweenPolls == 0) poll();
    Part part = queue[next];
    const auto& [a, b, c] = part.corners;
    const glm::dvec3 centre = (a + b + c) * (1.0 / 3);
    if (open) *open = centre;
    if (steps) *steps += kStepsOfPart;
    FourPoints points;
    points.set(a, b, c, centre);
    double centre2 = std::numeric_limits<double>::infinity();  // the best known squared distance of the centre
    std::uint32_t below = DistanceGrid::kNone;                 // the triangle at this distance
    std::array<std::uint32_t, 13> tried;
    int tries = 0;
    std::uint32_t exact = Hierarchy::kNone;  // the nearest triangle, after a search for it
    const auto covered_by = [&](std::uint32_t triangle) {
      if (triangle == DistanceGrid::kNone) return false;
      for (int i = 0; i < tries; ++i) {
        if (tried[i] == triangle) return false;
      }
      tried[tries++] = triangle;
      if (facing && !facing->admits(triangle)) return false;
      double d2[4];
      witness_distances(reference_[triangle], points, d2);
      if (d2[3] < centre2) centre2 = d2[3], below = triangle;
      // A comparison with NaN is false, so that NaN is not covered.
      if (d2[0] <= limit2_ && d2[1] <= limit2_ && d2[2] <= limit2_) {
        if (facing) facing->take(triangle);
        farthest2 = std::max({farthest2, d2[0], d2[1], d2[2]});
        return true;
      }
      return false;
    };
    // Where the tolerance is larger than what the reference bounds, the nearest triangle among those that are admitted
    // takes a look at most of them. The longer searches end at any of these that covers the part.
    FacingRule::Enough covers;
    if (kSearch != Search::quick && facing) {
      covers = [&](std::uint32_t triangle) {
        double d2[4];
        witness_distances(reference_[triangle], points, d2);
        return d2[0] <= limit2_ && d2[1] <= limit2_ && d2[2] <= limit2_;
      };
    }
    const std::uint32_t guess = grid_->triangle_near(centre);
    if (covered_by(hints.x) || covered_by(hints.y) || covered_by(hints.z) || covered_by(guess)) continue;

    const double longest2 = longest_squared(part);
    const bool seems_outside = !(centre2 <= limit2_);
    bool looked_around = guess == DistanceGrid::kNone;
    const auto covered_by_node_around = [&] {
      looked_around = true;
      const glm::dvec3 cell = glm::floor((centre - grid_->origin) * (1 / grid_->spacing));
      for (int i = 0; i < 8; ++i) {
        const glm::ivec3 node = glm::ivec3(cell) + glm::ivec3(i & 1, (i >> 1) & 1, i >> 2);
        if (glm::any(glm::lessThan(node, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(node, grid_->nodes)))
          continue;
        if (covered_by(grid_->triangle[grid_->index(node.x, node.y, node.z)])) return true;
      }
      return false;
    };
    if (!looked_around && (seems_outside || longest2 < kSmall * kSmall * limit2_) && covered_by_node_around()) continue;
    if (!(centre2 <= limit2_) || longest2 < kExact * kExact * limit2_) {
      if (hint == Hierarchy::kNone) hint = guess;
      const std::uint32_t nearest = around.nearest(part, centre, radius, hint, covers);
      if (nearest == Hierarchy::kNone) return Verdict::outside;
      hint = exact = nearest;
      if (covered_by(exact)) continue;
      // A search that need not tell outside from unproved ends at a centre that is outside.
      if (!kProve && !(centre2 <= limit2_)) return Verdict::unproved;
    }
    // A comparison with NaN is false, so that NaN ends here.
    constexpr double kShortest = kSearch == Search::quick ? kQuickFloor : kFloor;
    if (!(longest2 > kShortest * kShortest * limit2_) || part.cuts == kMostCuts) {
      if (!kProve) return Verdict::unproved;
      result = Verdict::unproved;
      continue;
    }
    const auto cut_along = [&](std::uint32_t triangle) {
      return cut(part, reference_[triangle], kWorthCutting * limit_, queue);
    };
    const WitnessTriangle t = reference_[below];
    // If the triangles are smaller than the tolerance, a cut along an edge of one of them hardly shortens a long part.
    const bool long_over_small =
        longest2 > kLong * kLong * limit2_ && std::max(squared_length(t.ab), squared_length(t.ac)) <= limit2_;
    if (!long_over_small) {
      if (cut_along(below)) continue;
      if (!looked_around) {
        const std::uint32_t before = below;
        if (covered_by_node_around() || (below != before && cut_along(below))) continue;
      }
      // Among slivers it happens that no node of the grid names the triangle below the centre. Where many are side by
      // side, a search finds another one nearly always, and hardly ever one that helps.
      if (exact == Hierarchy::kNone && !(are_needles && in_vain == kSearchesInVain)) {
        exact = around.nearest(part, centre, limit_, below, covers);
        // By rounding there may be none, if the centre is as far away as it may be.
        const bool is_another = exact != below && exact != Hierarchy::kNone;
        if (is_another && (covered_by(exact) || cut_along(exact))) {
          in_vain = 0;
          continue;
        }
        ++in_vain;
      }
    }
    split(part, queue);
  }
  farthest = std::sqrt(farthest2);
  return result;
}

double TriangleCertificate::bound(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds, const glm::uvec3& hints,
                                  Facing* facing) const {
  return bound_by<Search::quick>(corners, bounds, hints, facing);
}

template <TriangleCertificate::Search kSearch>
double TriangleCertificate::bound_by(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds, const glm::uvec3& hints,
                                     Facing* facing, glm::dvec3* open, std::size_t* steps) const {
  if (facing) facing->begin();
  double farthest = bound_by_corners(corners, bounds);
  if (farthest != kUnproved && (!facing || facing->take_corners())) return farthest;
  return search<kSearch>(corners, hints, facing, farthest, open, steps) == Verdict::inside ? farthest : kUnproved;
}

double TriangleCertificate::bound_in_any_order(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds,
                                               const glm::uvec3& hints, Facing* facing, glm::dvec3* open,
                                               std::size_t* steps) const {
  const Ordered ordered(corners, hints);
  return bound_by<Search::fine>(ordered.corners, bounds, ordered.hints, facing, open, steps);
}

double TriangleCertificate::bound_with_room(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds,
                                            Facing* facing) const {
  const glm::uvec3 no_hints(Hierarchy::kNone);
  const double bounded = narrowed(1 - kRoomToLeave).bound(corners, bounds, no_hints, facing);
  return bounded == kUnproved ? bound(corners, bounds, no_hints, facing) : bounded;
}

Verdict TriangleCertificate::verdict(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds, const glm::uvec3& hints,
                                     Facing* facing) const {
  if (facing) facing->begin();
  if (bound_by_corners(corners, bounds) != kUnproved && (!facing || facing->take_corners())) return Verdict::inside;
  const Ordered ordered(corners, hints);
  double farthest = 0;
  const Verdict found = search<Search::verdict>(ordered.corners, ordered.hints, facing, farthest);
  const auto& [a, b, c] = ordered.corners;
  if (found != Verdict::unproved || b != c || facing) return found;
  return covers_segment(reference_, *hierarchy_, a, b, limit_) ? Verdict::inside : Verdict::unproved;
}

std::vector<Verdict> Certificate::verdicts(const PlacedPieces& pieces, const Options& options) const {
  const ToleranceVolume& volume = this->volume();
  const double limit = volume.provable(pieces.mapping_error), beyond = volume.refutable(pieces.mapping_error);
  const TriangleCertificate certificate(volume.witnesses(), volume.grid(), volume.hierarchy(), limit, beyond);

  // The distances of the used points come first: faces share them, and they settle most faces.
  std::vector<TriangleCertificate::PointBound> nearest(pieces.points.size());
  constexpr std::size_t kBlock = 128;
  parallel_for(nearest.size(), kBlock, options.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (pieces.used[i]) nearest[i] = certificate.nearest(pieces.points[i], beyond);
    }
  });

  std::vector<Verdict> verdicts(pieces.size());
  parallel_for(verdicts.size(), kBlock, options.threads, [&](std::size_t begin, std::size_t end) {
    if (options.progress) options.progress->update(static_cast<double>(begin) / static_cast<double>(verdicts.size()));
    for (std::size_t i = begin; i < end; ++i) {
      const std::span<const std::uint32_t> corner = pieces.indices.subspan(i * pieces.corners, pieces.corners);
      const auto triangle = [&](int a, int b, int c) {
        const std::uint32_t ia = corner[a], ib = corner[b], ic = corner[c];
        const glm::uvec3 hints(nearest[ia].triangle, nearest[ib].triangle, nearest[ic].triangle);
        if (glm::any(glm::equal(hints, glm::uvec3(Hierarchy::kNone)))) return Verdict::outside;
        const glm::dvec3 bounds(nearest[ia].distance, nearest[ib].distance, nearest[ic].distance);
        return certificate.verdict({pieces.points[ia], pieces.points[ib], pieces.points[ic]}, bounds, hints);
      };
      verdicts[i] = Verdict::inside;
      for (const auto& [a, b, c] : triangles_of(pieces.corners)) verdicts[i] = std::min(verdicts[i], triangle(a, b, c));
    }
  });
  poll();  // a call that was cancelled at its end has no verdicts either
  return verdicts;
}

}  // namespace tolvol
