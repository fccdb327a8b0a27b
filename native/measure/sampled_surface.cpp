// SPDX-License-Identifier: GPL-3.0-or-later
// This is stratified sampling: pieces are refined if the bounds on the mean over a piece are far apart, and each piece
// has one point that is as good as random. The middle of each piece would be good enough if the pieces are short beside
// the distances. If not, it misses most of the folds of the distance, and the mean came out 0.5 % of the largest
// distance too low between a scan and its decimation within 0.1 %. The choice of the pieces to refine must not depend
// on their points, which would no longer be random; so the bounds are from the middle.
#include "measure/sampled_surface.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "base/call.h"
#include "base/parallel.h"
#include "measure/split.h"

namespace tolvol {
namespace {

using glm::dvec3;

// There are at most this many pieces for each triangle, or a sixth more pieces than at first if that is more.
constexpr std::size_t kBudgetPerTriangle = 4;
// Pieces are cut until the range of the mean is no wider than this share of the largest distance.
constexpr double kEnough = 0.001;
// Cutting ends when there is room to cut fewer pieces than the budget over kLeastRoom, because each round looks at all
// pieces.
constexpr std::size_t kLeastRoom = 64;
// The progress is updated after this many pieces.
constexpr std::size_t kPiecesPerUpdate = 4096;
// A thread takes so many pieces at once.
constexpr std::size_t kPiecesAtOnce = 64;

/// Returns b, or one triangle of it if b is a point: to every search all of its triangles would be about as near.
TriangleMesh searched(const TriangleMesh& b) {
  return is_a_point(b) ? TriangleMesh{b.vertices, {b.triangles.front()}} : b;
}

}  // namespace

SampledSurface::SampledSurface(const PlacedPair& pair, const TriangleMesh& world_b, const DeviationOptions& options)
    : b_(searched(pair.b)),
      hierarchy_(b_, options.threads),
      sides_(pair, world_b),
      threads_(options.threads),
      progress_(options.progress) {
  const TriangleMesh& a = pair.a;
  for (const Measure measure : {kArea, kLength, kNumber}) {
    measure_ = measure;
    total_ = Sum();
    pieces_.clear();
    for (const glm::uvec3& t : a.triangles) {
      poll_at(pieces_.size());
      pieces_.push_back({simplex_of({a.vertices[t.x], a.vertices[t.y], a.vertices[t.z]}, measure), 0, {}, 0, 0, false});
      total_.add(measure_of(pieces_.back().simplex));
    }
    if (total_.value() > 0) break;
  }
  std::vector<SampledPiece> triangles;
  triangles.swap(pieces_);
  for (const SampledPiece& triangle : triangles) {
    const double whole = measure_of(triangle.simplex), parts = whole / total_.value() * double(options.pieces);
    const int k = std::max(1, int(std::lround(measure_ == kArea ? std::sqrt(parts) : parts)));
    const double share = measure_ == kNumber ? 1 : 1.0 / (measure_ == kArea ? double(k) * k : k);
    cut(triangle.simplex, k, [&](const Simplex& part) {
      poll_at(pieces_.size());
      pieces_.push_back({part, whole * share, {}, 0, 0, false});
    });
  }
  budget_ = std::max({options.pieces + options.pieces / 6, kBudgetPerTriangle * a.triangles.size(), pieces_.size()});
  most_steps_ = std::size_t(options.steps * double(budget_));
}

void SampledSurface::measure() {
  evaluate(pieces_, 0, true);
  while (measure_ != kNumber && refine()) continue;
}

std::size_t SampledSurface::evaluate(std::span<SampledPiece> pieces, std::size_t first, bool all) {
  std::size_t done = 0;
  while (done < pieces.size() && (all || steps_ < most_steps_)) {
    const std::size_t count = std::min(kPiecesPerUpdate, pieces.size() - done);
    const bool loosely = steps_ >= most_steps_;
    std::atomic<std::size_t> steps = 0;
    parallel_for(count, kPiecesAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
      std::uint32_t hint = Hierarchy::kNone;
      std::size_t made = 0;
      for (std::size_t i = done + begin; i < done + end; ++i) {
        SampledPiece& piece = pieces[i];
        if (!loosely) {
          piece.bounds = distance_bounds(piece.simplex, b_, hierarchy_, hint);
          hint = piece.bounds.nearest;
          made += piece.bounds.steps;
        }
        const dvec3 weights = weights_in(piece.simplex, first + i);
        const auto& p = piece.simplex.corner;
        const dvec3 point = weights.x * p[0] + weights.y * p[1] + weights.z * p[2];
        const Hierarchy::Nearest nearest = hierarchy_.nearest(point, std::numeric_limits<double>::infinity(), hint);
        if (loosely) {
          piece.bounds = bounds_around(point, nearest, piece.simplex, b_);
          hint = nearest.triangle;
        }
        piece.distance = nearest.distance;
        piece.average = piece.corrected(weights);
        piece.inside = sides_.inside(point, nearest);
        made += nearest.nodes;
      }
      steps += made;
    });
    steps_ += steps;
    done += count;
    if (progress_) progress_->update(double(first + done) / double(budget_));
  }
  return done;
}

template <class Visit>
void SampledSurface::halve(const SampledPiece& piece, Visit&& visit) const {
  if (measure_ == kLength) return cut(piece.simplex, 2, visit);
  const glm::uvec3& t = b_.triangles[piece.bounds.nearest];
  const TriangleCorners nearest{b_.vertices[t.x], b_.vertices[t.y], b_.vertices[t.z]};
  const Parts parts = split(piece.simplex.corner, nearest, nearest);
  for (int i = 0; i < parts.count; ++i) visit(Simplex{parts.corners[i], kArea});
}

bool SampledSurface::refine() {
  poll();
  Sum gap;
  double largest = 0;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    poll_at(i);
    const SampledPiece& piece = pieces_[i];
    gap.add(piece.gap());
    largest = std::max(largest, piece.distance);
  }
  const double enough = std::max(kEnough * largest, kRangeNoise) * total_.value();
  const std::size_t room = (budget_ - pieces_.size()) / 2;  // a piece leaves two or three
  if (gap.value() <= enough || room < budget_ / kLeastRoom || steps_ >= most_steps_) return false;
  // The pieces above the wanted average are cut, the worst of them first if there is no room for all.
  std::vector<std::size_t> worst;
  for (std::size_t i = 0; i < pieces_.size(); ++i) {
    poll_at(i);
    if (pieces_[i].gap() * double(pieces_.size()) > enough) worst.push_back(i);
  }
  if (worst.size() > room) {
    std::nth_element(worst.begin(), worst.begin() + std::ptrdiff_t(room), worst.end(),
                     [&](std::size_t i, std::size_t j) {
                       const double x = pieces_[i].gap(), y = pieces_[j].gap();
                       return x != y ? x > y : i < j;
                     });
    worst.resize(room);
    std::sort(worst.begin(), worst.end());
  }
  poll();
  std::vector<SampledPiece> parts;
  std::vector<std::size_t> cut, end;  // holds the pieces that have parts, and the ends of their parts
  for (const std::size_t i : worst) {
    poll_at(parts.size());
    halve(pieces_[i], [&](const Simplex& part) { parts.push_back({part, measure_of(part), {}, 0, 0, false}); });
    if (parts.size() == (end.empty() ? 0 : end.back())) continue;
    cut.push_back(i);
    end.push_back(parts.size());
  }
  poll();
  // A piece whose parts are not all known stays whole.
  const std::size_t known = evaluate(parts, pieces_.size() - cut.size(), false);
  while (!end.empty() && end.back() > known) end.pop_back();
  for (std::size_t k = 0; k < end.size(); ++k) pieces_[cut[k]].weight = -1;
  std::size_t seen = 0;
  std::erase_if(pieces_, [&](const SampledPiece& piece) {
    poll_at(++seen);
    return piece.weight < 0;
  });
  for (std::size_t i = 0; i < (end.empty() ? 0 : end.back()); ++i) {
    poll_at(i);
    pieces_.push_back(parts[i]);
  }
  return !end.empty();
}

}  // namespace tolvol
