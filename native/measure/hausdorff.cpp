// SPDX-License-Identifier: GPL-3.0-or-later
// This is branch and bound over pieces of a, after M. Tang, M. Lee, Y. Kim, Interactive Hausdorff Distance Computation
// for General Polygonal Models, 2009, with a sharper bound, a way to split that ends, and rounding inside the interval.
//
// - The upper bound of a piece, a triangle: the distance to one triangle T of b is convex, so that over the piece it is
//   largest at a corner. One search of the hierarchy finds a T for which that is small enough, if there is one. If not,
//   the triangle nearest to the centroid gives an upper bound, and the piece waits to be split.
// - The lower bound is the distance to b at any point of a.
// - Splitting: halving the longest edge brings a piece to the size of the triangles near it. Then the piece is cut
//   along the edges of the nearest triangle T, by planes perpendicular to T. A part above T has its largest distance to
//   T at a corner, and the corner is a point of a, so that both bounds meet at once. Halving alone would never end
//   along the edges of b if the two surfaces touch. Where two sheets of b are as near, which halving approaches in
//   pieces as small as the interval is narrow, the piece is cut there.
// - The order: pieces with the largest upper bounds come first, in batches of a fixed size. Each piece of a batch sees
//   the lower bound from before the batch, so that nothing depends on which thread is faster.
//
// Rounding is covered as follows, with u = 2^-53. Every point has |x| <= 1 in the frame, so that a difference of two is
// at most 2 long. One operation on the three coordinates of a vector (sum, difference, product with a number) errs by
// at most u times the length of its result. Powers of two, by which frame and hierarchy scale, are exact.
// - Placing a vertex of a errs by u, and a vertex of b that is cut off by 4 u (measure/near_part.h), so that the
//   distance between the surfaces changes by at most 5 u.
// - The true pieces tile the triangle. Piece::error, kSplitError for each split on the way, bounds the distance of
//   their corners from the stored corners.
// - A witness a + v ab + w ac errs by 2 u (v + w) for the differences, as much for the products, and 2 u for the sums.
//   v + w may exceed 1 by 2 u, which puts the witness 4 u outside; this is 10 u together. Its distance, at most 2, has
//   a relative error below 4 u, which is 8 u. So the true distance is at most U + error + 23 u, kUpperMargin.
// - The computed nearest distance is not a lower bound, because a witness need not be the nearest point.
//   certified_distance separates p from each triangle T near it by a plane: |p - x| >= v . (p - x) / |v| for all x in T
//   and any v, least at a corner. The difference and the dot product err by 4 u |v| 2, and |v| and the quotient by 4 u
//   2, together 16 u. The point p is off by the error of its piece, 3 u more for a centroid, and 5 u for placing. All
//   this is kLowerMargin, 27 u.
#include "measure/hausdorff.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/call.h"
#include "base/parallel.h"
#include "geometry/hierarchy.h"
#include "geometry/weld.h"
#include "measure/placed_pair.h"
#include "measure/split.h"

namespace tolvol {
namespace {

using glm::dvec3;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGap = 0.001;  // An interval is narrow if its width is at most this share of `upper`.
// The derivation of this constant and of the next is above.
constexpr double kUpperMargin = 23 * kUnitRoundoff;
constexpr double kLowerMargin = 27 * kUnitRoundoff;
// The search ends at an interval or a piece shorter than this, in frame lengths, because it is within rounding.
constexpr double kNoise = 256 * kUnitRoundoff;
// A piece whose middle corner is nearer than this, in frame lengths, to the segment between the other two counts as
// that segment. Its error grows by twice as much, which is more than the rounding of the distance.
constexpr double kFlat = 8 * kUnitRoundoff;
// About this many splits on the way to a piece have regard to one triangle of b alone; later ones also to a second.
constexpr int kSplitsWithOneTriangle = 8;
// This many triangles give a first lower bound.
constexpr std::size_t kSeeds = 4096;
// The multiples of this prime modulo a smaller number visit each number below that once, in jumps.
constexpr std::size_t kSpread = 1'000'003;
// In the first pass kChunk pieces see the same lower bound, and a thread takes kBlock of them at once. Later kBatch
// pieces see the same lower bound, and a thread takes kSmallBlock of them at once.
constexpr std::size_t kChunk = 16384, kBlock = 64, kBatch = 512, kSmallBlock = 8;
// The budget, in pieces. An edge of b that crosses a triangle of a costs a few pieces, so that a subdivided copy needs
// about ten for each of its triangles. A piece costs 1 us and, while it waits, 100 bytes. As long as the bound is not
// decided about, the budget is kPiecesToDecide.
constexpr std::size_t kPieces = 1'000'000, kPiecesToDecide = 4'000'000, kPiecesPerTriangle = 16;
// After this many pieces the search accepts a wider interval: by kGap of the bound, or of the length below if that is
// less, for as many pieces again. Nearly all searches end before, those between a surface and its subdivided copy among
// them. Needles that lie on one another would need a million pieces to show that nothing but rounding is between them.
constexpr std::size_t kPatience = 20'000, kPatiencePerTriangle = 12;
// The parts of a piece count as one piece for each so many nodes that their searches visit, if that is more than their
// number: at a corner that thousands of triangles share, one search may look at all of them.
constexpr std::size_t kNodesPerPiece = 64;
// If the bound is larger than this, in frame lengths, growth() counts with this in its place.
constexpr double kLargestBound = 1e-3;

struct Piece {
  std::array<dvec3, 3> corner;
  double error = 0;
  double upper = 0;
  std::uint32_t triangle = 0;  // This is a triangle of a.
  // This triangle of b gives `upper`. Until one is looked for, it is a guess.
  std::uint32_t nearest = Hierarchy::kNone;
};

/// A piece that waits to be split. Pieces are not moved while the queue is put in order.
struct Waiting {
  double upper;
  std::uint32_t place;  // The piece is at this place of `store_`.

  bool operator<(const Waiting& other) const { return upper < other.upper; }
};

struct Sample {
  double distance = -1;
  dvec3 point{0};
  double error = 0;
  std::uint32_t triangle = 0;

  void improve(const Sample& other) {
    if (other.distance > distance) *this = other;
  }
};

/// The corners of a piece and of its parts at which the distance to b has been looked at. It is looked at once.
class Sampled {
 public:
  Sampled() = default;
  explicit Sampled(const std::array<dvec3, 3>& corners) : count_(3) { std::copy_n(corners.begin(), 3, point_.begin()); }

  /// Returns false if p has been added before.
  bool add(const dvec3& p) {
    const auto end = point_.begin() + count_;
    if (std::find(point_.begin(), end, p) != end) return false;
    point_[count_++] = p;
    return true;
  }

 private:
  std::array<dvec3, 5> point_;  // a split makes at most two new points
  int count_ = 0;
};

struct Children {
  std::array<Piece, 3> piece;
  int count = 0;
  std::size_t nodes = 0;  // is how many the searches for the pieces have visited
};

dvec3 without(const dvec3& v, const dvec3& direction) {
  const double length2 = glm::dot(direction, direction);
  return length2 > 0 ? v - glm::dot(v, direction) / length2 * direction : v;
}

std::vector<std::uint32_t> welded(std::span<const dvec3> vertices, unsigned threads) {
  Team team(thread_count(threads));
  return weld_equal_positions(vertices, team);
}

class Search {
 public:
  Search(const TriangleMesh& a, const TriangleMesh& b, double bound, const HausdorffOptions& options)
      : a_(a),
        b_(b),
        hierarchy_(b, options.threads),
        place_(welded(a.vertices, options.threads)),
        seen_(a.vertices.size()),
        bound_(bound),
        options_(options),
        patience_(kPatience + kPatiencePerTriangle * (a.triangles.size() + b.triangles.size())) {}

  void run() {
    const std::size_t more = kPiecesPerTriangle * (a_.triangles.size() + b_.triangles.size());
    seed();
    first_pass();
    while (!queue_.empty() && queue_.front().upper > cutoff() && lower_ <= bound_) {
      if (pieces_ >= more + (upper() <= bound_ ? kPieces : kPiecesToDecide)) break;
      refine();
    }
  }

  double lower() const { return lower_; }
  double upper() const { return std::max(settled_, queue_.empty() ? 0 : queue_.front().upper); }
  const Sample& farthest() const { return farthest_; }

 private:
  /// Pieces whose upper bound is no larger than this need no more work.
  double cutoff() const {
    const double narrow = std::max(lower_ / (1 - kGap), lower_ + growth());
    if (lower_ > bound_) return std::max(narrow, lower_ + kNoise);
    return std::max(options_.narrow ? std::min(bound_, narrow) : bound_, lower_ + kNoise);
  }

  /// Returns the width that the search accepts because it takes long.
  double growth() const {
    const double beyond = double(pieces_) / double(patience_) - 1;
    return beyond <= 0 ? 0 : kGap * beyond * std::min(bound_, kLargestBound);
  }

  std::array<dvec3, 3> corners(const TriangleMesh& mesh, std::uint32_t i) const {
    const glm::uvec3& t = mesh.triangles[i];
    return {mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]};
  }

  /// Returns a bit for each corner of a triangle of a_, from the lowest on: whether no earlier call had its place. The
  /// distance at a corner that many triangles share, near which there may be as many of b_, is thus looked at once.
  std::uint8_t fresh_corners(std::uint32_t triangle) {
    std::uint8_t fresh = 0;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t place = place_[a_.triangles[triangle][k]];
      if (!seen_[place]) fresh |= static_cast<std::uint8_t>(1u << k);
      seen_[place] = true;
    }
    return fresh;
  }

  void report(double fraction) const {
    if (options_.progress) options_.progress->update(fraction);
  }

  /// Finds a first lower bound from triangles spread over the mesh. The better it is, the more pieces end at once. The
  /// first few triangles shorten the searches of the others.
  void seed() {
    const std::size_t count = std::min(a_.triangles.size(), kSeeds);
    for (std::size_t first = 0; first < count;) {
      const std::size_t end_of_round = std::min(count, 8 * first + 8);
      std::vector<Sample> samples(end_of_round - first);
      const auto seed_at = [&](std::size_t i) {
        return std::uint32_t(i * kSpread % count * a_.triangles.size() / count);
      };
      std::vector<std::uint8_t> fresh(samples.size());
      for (std::size_t i = 0; i < fresh.size(); ++i) fresh[i] = fresh_corners(seed_at(first + i));
      parallel_for(samples.size(), kBlock, options_.threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const std::uint32_t triangle = seed_at(first + i);
          const std::array<dvec3, 3> p = corners(a_, triangle);
          const dvec3 centroid = (p[0] + p[1] + p[2]) / 3.0;
          const Hierarchy::Common middle = far_from(centroid, Hierarchy::kNone);
          samples[i] = {middle.distance, centroid, 0, triangle};
          for (int k = 0; k < 3; ++k) {
            if (!(fresh[i] >> k & 1)) continue;
            samples[i].improve({far_from(p[k], middle.triangle).distance, p[k], 0, triangle});
          }
        }
      });
      learn(samples);
      first = end_of_round;
    }
  }

  /// Returns the triangle of b nearest to p, or any triangle that shows that p does not raise the lower bound, because
  /// the search for the nearest of many triangles that are about as near looks at all of them.
  Hierarchy::Common far_from(const dvec3& p, std::uint32_t hint) const {
    return hierarchy_.common(std::array{p}, kInfinity, lower_ + kUpperMargin, hint);
  }

  void first_pass() {
    const std::size_t count = a_.triangles.size();
    for (std::size_t chunk = 0; chunk < count; chunk += kChunk) {
      const std::size_t chunk_end = std::min(chunk + kChunk, count);
      std::vector<Piece> pieces(chunk_end - chunk);
      std::vector<Sample> samples(pieces.size());
      std::vector<std::uint8_t> fresh(pieces.size());
      for (std::size_t i = 0; i < fresh.size(); ++i) fresh[i] = fresh_corners(std::uint32_t(chunk + i));
      parallel_for(pieces.size(), kBlock, options_.threads, [&](std::size_t begin, std::size_t end) {
        std::uint32_t hint = Hierarchy::kNone;
        for (std::size_t i = begin; i < end; ++i) {
          pieces[i].triangle = std::uint32_t(chunk + i);
          pieces[i].corner = corners(a_, pieces[i].triangle);
          pieces[i].nearest = hint;
          Sampled sampled;
          for (int k = 0; k < 3; ++k) {
            if (!(fresh[i] >> k & 1)) sampled.add(pieces[i].corner[k]);
          }
          std::size_t nodes = 0;
          samples[i] = evaluate(pieces[i], sampled, nodes);
          hint = pieces[i].nearest;
        }
      });
      learn(samples);
      for (const Piece& piece : pieces) keep(piece);
      report(0.5 * double(chunk_end) / double(count));
    }
  }

  void refine() {
    poll();
    std::vector<Piece> batch;
    const double enough = cutoff();
    while (batch.size() < kBatch && !queue_.empty() && queue_.front().upper > enough) batch.push_back(take());
    std::vector<Children> children(batch.size());
    std::vector<Sample> samples(batch.size());
    parallel_for(batch.size(), kSmallBlock, options_.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        children[i] = split(batch[i]);
        Sampled sampled(batch[i].corner);
        for (int k = 0; k < children[i].count; ++k) {
          samples[i].improve(evaluate(children[i].piece[k], sampled, children[i].nodes));
        }
      }
    });
    learn(samples);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      if (children[i].count == 0) settled_ = std::max(settled_, batch[i].upper);
      for (int k = 0; k < children[i].count; ++k) keep(children[i].piece[k]);
      pieces_ += std::max(static_cast<std::size_t>(children[i].count), children[i].nodes / kNodesPerPiece);
    }
    report(0.5 + 0.5 * std::min(1.0, lower_ / std::max(upper(), kNoise)));
  }

  void keep(const Piece& piece) {
    if (piece.upper <= cutoff()) {
      settled_ = std::max(settled_, piece.upper);
      return;
    }
    if (free_.empty()) {
      free_.push_back(std::uint32_t(store_.size()));
      store_.emplace_back();
    }
    store_[free_.back()] = piece;
    queue_.push_back({piece.upper, free_.back()});
    free_.pop_back();
    std::push_heap(queue_.begin(), queue_.end());
  }

  Piece take() {
    std::pop_heap(queue_.begin(), queue_.end());
    const std::uint32_t place = queue_.back().place;
    queue_.pop_back();
    free_.push_back(place);
    return store_[place];
  }

  /// Sets `upper` and `nearest` of a piece, whose `nearest` is a guess before. Returns the best lower bound it finds,
  /// not certified, or none for a piece that is settled. Adds to `sampled` the corners at which it has looked, and to
  /// `nodes` the number of nodes that it has visited.
  Sample evaluate(Piece& piece, Sampled& sampled, std::size_t& nodes) const {
    const double margin = kUpperMargin + piece.error, enough = cutoff() - margin;
    if (enough >= 0) {
      const Hierarchy::Common common = hierarchy_.common(piece.corner, enough, enough, piece.nearest);
      nodes += common.nodes;
      if (common.triangle != Hierarchy::kNone) {
        piece.nearest = common.triangle;
        piece.upper = common.distance + margin;
        return {};
      }
    }
    const dvec3 middle = (piece.corner[0] + piece.corner[1] + piece.corner[2]) / 3.0;
    const Hierarchy::Nearest nearest = hierarchy_.nearest(middle, kInfinity, piece.nearest);
    nodes += nearest.nodes;
    piece.nearest = nearest.triangle;
    piece.upper = 0;
    Sample best{nearest.distance, middle, piece.error, piece.triangle};
    const std::array<dvec3, 3> t = corners(b_, piece.nearest);
    for (const dvec3& corner : piece.corner) {
      const double distance = std::sqrt(closest_point(corner, t[0], t[1], t[2]).distance_squared);
      piece.upper = std::max(piece.upper, distance + margin);
      if (!sampled.add(corner) || distance <= std::max(lower_, best.distance)) continue;
      const Hierarchy::Common far = far_from(corner, piece.nearest);
      nodes += far.nodes;
      best.improve({far.distance, corner, piece.error, piece.triangle});
    }
    return best;
  }

  void learn(const std::vector<Sample>& samples) {
    Sample best;
    for (const Sample& sample : samples) best.improve(sample);
    if (best.distance <= lower_ && farthest_.distance >= 0) return;
    const double certified = std::max(0.0, certified_distance(best.point) - kLowerMargin - best.error);
    if (certified > lower_ || farthest_.distance < 0) lower_ = certified, farthest_ = best;
  }

  double certified_distance(const dvec3& p) const {
    double bound = hierarchy_.nearest(p).distance;
    hierarchy_.for_each_within(p, bound,
                               [&](std::uint32_t i) { bound = std::min(bound, separation(p, corners(b_, i), bound)); });
    return bound;
  }

  /// Returns a lower bound on the distance of p from triangle t, by the best of some separating planes or the first
  /// that shows `enough`.
  static double separation(const dvec3& p, const std::array<dvec3, 3>& t, double enough) {
    double best = 0;
    const auto along = [&](const dvec3& v) {
      const double length = glm::length(v);
      if (length < 1e-150) return;  // the square of a shorter vector has lost its bits
      best = std::max(best, std::min({glm::dot(v, p - t[0]), glm::dot(v, p - t[1]), glm::dot(v, p - t[2])}) / length);
    };
    const dvec3 r = p - closest_point(p, t[0], t[1], t[2]).point;
    along(r);
    if (best >= enough) return best;
    // A short r has the direction of its rounding. The part of it that is orthogonal to the edge or face of the witness
    // is sharp.
    const std::array<dvec3, 3> edge{t[1] - t[0], t[2] - t[1], t[0] - t[2]};
    int longest = 0;
    for (int i = 0; i < 3; ++i) {
      along(without(without(r, edge[i]), edge[i]));
      if (glm::dot(edge[i], edge[i]) > glm::dot(edge[longest], edge[longest])) longest = i;
    }
    const dvec3 base = edge[longest], height = without(without(edge[(longest + 1) % 3], base), base);
    along(without(without(without(without(r, base), height), base), height));
    return best;
  }

  /// Makes a piece that is flat within rounding a segment, whose parts do not overlap.
  static Piece flattened(Piece piece) {
    for (int i = 0; i < 3; ++i) {
      dvec3 &p = piece.corner[i], &q = piece.corner[(i + 1) % 3], &middle = piece.corner[(i + 2) % 3];
      if (middle == p || middle == q) return piece;
      const double height = std::sqrt(closest_point(middle, p, q, q).distance_squared);
      if (height > kFlat) continue;
      piece.error += height + kFlat;
      middle = q;
      return piece;
    }
    return piece;
  }

  /// Returns the triangle nearest to the corner of a piece that is farthest from piece.nearest. This takes as long as a
  /// split, and most pieces end without it, so that it is found only after some splits.
  std::uint32_t other_nearest(const Piece& piece) const {
    if (piece.error < kSplitsWithOneTriangle * kSplitError) return piece.nearest;
    const std::array<dvec3, 3> t = corners(b_, piece.nearest);
    const dvec3* farthest = nullptr;
    double most = -1;
    for (const dvec3& corner : piece.corner) {
      const double squared = closest_point(corner, t[0], t[1], t[2]).distance_squared;
      if (squared > most) most = squared, farthest = &corner;
    }
    return hierarchy_.nearest(*farthest, kInfinity, piece.nearest).triangle;
  }

  /// Returns no part if the piece is too small.
  Children split(const Piece& whole) const {
    const Piece piece = flattened(whole);
    const Parts parts = tolvol::split(piece.corner, corners(b_, piece.nearest), corners(b_, other_nearest(piece)));
    Children children{{piece, piece, piece}, parts.count};
    for (int i = 0; i < parts.count; ++i) {
      children.piece[i].corner = parts.corners[i];
      children.piece[i].error += kSplitError;
    }
    return children;
  }

  const TriangleMesh &a_, &b_;
  Hierarchy hierarchy_;
  std::vector<std::uint32_t> place_;  // the first vertex of a_ at the place of each
  std::vector<bool> seen_;            // tells for each place whether fresh_corners() has had it
  double bound_;
  const HausdorffOptions& options_;
  const std::size_t patience_;  // After this many pieces the search accepts a wider interval.
  std::vector<Waiting> queue_;  // is a heap with the largest upper bound in front
  std::vector<Piece> store_;    // holds the pieces of the queue, at places that are not in `free_`
  std::vector<std::uint32_t> free_;
  double settled_ = 0;  // is the largest upper bound of all pieces that left the queue
  double lower_ = 0;
  Sample farthest_;
  std::size_t pieces_ = 0;
};

}  // namespace

HausdorffInterval hausdorff(const TriangleMesh& a, const TriangleMesh& b, const HausdorffOptions& options) {
  if (options.bound && !(*options.bound >= 0)) throw InvalidInput("bound is not a length of 0 or more");
  const Call call(options.progress);
  if (options.progress) options.progress->begin("measuring");
  const PlacedPair pair(a, b);
  const Frame& frame = pair.frame;
  Search search(pair.a, pair.b, options.bound ? *options.bound * frame.scale() : kInfinity, options);
  search.run();
  // A step outwards covers the quotient, which is exact except for results below the smallest normal number.
  const Sample& farthest = search.farthest();
  return {std::max(0.0, std::nextafter(search.lower() / frame.scale(), -kInfinity)),
          std::nextafter(search.upper() / frame.scale(), kInfinity), frame.to_world(farthest.point), farthest.triangle};
}

}  // namespace tolvol
