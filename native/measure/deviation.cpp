// SPDX-License-Identifier: GPL-3.0-or-later
// This is stratified sampling: pieces are refined if the bounds on the mean over a piece are far apart, and each piece
// has one point that is as good as random. The middle of each piece would be good enough if the pieces are short beside
// the distances. If not, it misses most of the folds of the distance, and the mean came out 0.5 % of the largest
// distance too low between a scan and its decimation within 0.1 %. The choice of the pieces to refine must not depend
// on their points, which would no longer be random; so the bounds are from the middle. Every statistic is one of a
// distribution by area. The distances at the points give the estimate, and the lower and the upper bounds of the pieces
// give the ends of its range. In the mean the distance at a point is corrected by what is known about its piece: by the
// mean of a linear function between the bounds, less the value of the function at the point.
//
// The bounds of a piece include their own rounding, and leave more room between them than the error of the sums of
// weighted bounds. Weights are added in another order for each distribution, so that equal shares may differ in the
// last bits. If the ends of a range depend on shares alone, kShareRounding is between them.
#include "measure/deviation.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <sstream>

#include "base/call.h"
#include "base/parallel.h"
#include "geometry/pseudonormals.h"
#include "measure/placed_pair.h"
#include "measure/split.h"

namespace tolvol {
namespace {

using glm::dvec3;

// A surface is first cut into about so many pieces. Those of a scan are then about 0.25 % of its size apart. Cutting
// fewer pieces further would bound each part and each whole.
constexpr double kPieces = 196608;
// There are at most so many pieces, or so many for each triangle if that is more.
constexpr std::size_t kBudget = 229376, kBudgetPerTriangle = 4;
// Pieces are cut until the range of the mean is no wider than this share of the largest distance.
constexpr double kEnough = 0.001;
// A range of the mean that is no wider than this, in the frame, is rounding.
constexpr double kNoise = 256 * kUnitRoundoff;
// A bound over a piece is a linear function. It enters the distributions by its values on so many equal shares, as many
// as DistanceBounds has quarters.
constexpr int kSlices = 4;
// Rounding changes a share by at most so much.
constexpr double kShareRounding = 32 * kUnitRoundoff;
// Cutting ends when there is room for so small a part of the budget: each round looks at all pieces.
constexpr std::size_t kLeastRoom = 64;
// The progress is looked at after so many pieces.
constexpr std::size_t kChunk = 4096;
// A thread takes so many pieces at once.
constexpr std::size_t kBlock = 64;
// What is no larger than this, in the frame, is within rounding of a point.
constexpr double kPoint = 4 * kUnitRoundoff;
// Products of three numbers up to 2 to this power do not overflow.
constexpr double kLargestExponent = 320;

/// Returns the weight of a piece in the averages. It depends on the number of corners of the pieces.
enum Measure { number = 1, length = 2, area = 3 };

double measure_of(const Simplex& s) {
  const auto& p = s.corner;
  if (s.corners == area) return 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
  return s.corners == length ? glm::distance(p[0], p[1]) : 1;
}

/// Returns the triangle itself, its longest edge or its first corner.
Simplex simplex_of(const std::array<dvec3, 3>& p, Measure measure) {
  Simplex s{p, measure};
  if (measure != length) return s;
  for (int i = 1; i < 3; ++i) {
    const dvec3 &from = p[i], &to = p[(i + 1) % 3];
    if (glm::distance(from, to) > glm::distance(s.corner[0], s.corner[1])) s.corner = {from, to, to};
  }
  return s;
}

/// Calls visit(piece) for k parts of a segment or k x k equal parts of a triangle.
template <class Visit>
void cut(const Simplex& s, int k, Visit&& visit) {
  const auto& p = s.corner;
  if (s.corners == number) visit(s);
  if (s.corners == length) {
    const auto at = [&](int i) { return glm::mix(p[0], p[1], double(i) / k); };
    for (int i = 0; i < k; ++i) visit(Simplex{{at(i), at(i + 1), at(i + 1)}, length});
  }
  if (s.corners == area) {
    const auto at = [&](int i, int j) { return p[0] + double(i) / k * (p[1] - p[0]) + double(j) / k * (p[2] - p[0]); };
    for (int i = 0; i < k; ++i) {
      for (int j = 0; i + j < k; ++j) {
        visit(Simplex{{at(i, j), at(i + 1, j), at(i, j + 1)}, area});
        if (i + j + 1 < k) visit(Simplex{{at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)}, area});
      }
    }
  }
}

/// Returns 0 <= u < 1 that is as good as random: the finaliser of SplitMix64 on the n-th odd multiple of the golden
/// ratio.
double uniform(std::uint64_t n) {
  n = (n + 1) * 0x9E3779B97F4A7C15u;
  n = (n ^ (n >> 30)) * 0xBF58476D1CE4E5B9u;
  n = (n ^ (n >> 27)) * 0x94D049BB133111EBu;
  return double((n ^ (n >> 31)) >> 11) * 0x1p-53;
}

/// Returns the weights of the corners at the n-th point, which are evenly spread over the piece.
dvec3 weights_in(const Simplex& s, std::uint64_t n) {
  if (s.corners == number) return {1, 0, 0};
  const double u = uniform(2 * n), v = uniform(2 * n + 1);
  if (s.corners == length) return {1 - u, u, 0};
  const double root = std::sqrt(u);
  return {1 - root, root * (1 - v), root * v};
}

struct Piece {
  Simplex simplex;
  double weight = 0;
  DistanceBounds bounds;
  double distance = 0;  // is that of its point
  double average = 0;   // estimates the mean over the piece: the distance of its point, corrected where that is sharper
  bool inside = false;  // tells whether its point is inside, if b is closed

  double signed_distance() const { return inside ? -distance : distance; }
  /// Returns the distance of the point with these weights less the value of a linear function there, plus its mean. The
  /// function is the middle between the bounds, so that the difference is small, and as good as random.
  double corrected(const dvec3& weights) const {
    if (!(bounds.room(simplex.corners) < bounds.value.upper - bounds.value.lower)) return distance;
    double middle = 0, mean = 0;
    for (int i = 0; i < simplex.corners; ++i) {
      const double at = 0.5 * (bounds.lower[i] + bounds.upper[i]);
      middle += weights[i] * at;
      mean += at / simplex.corners;
    }
    return distance - middle + mean;
  }
  double signed_average() const { return inside ? -average : average; }
  /// Returns the width of an interval that holds `average` whatever the point is.
  double width() const { return std::min(bounds.room(simplex.corners), bounds.value.upper - bounds.value.lower); }
  double gap() const { return weight * (bounds.mean.upper - bounds.mean.lower); }
};

/// Returns the number that the linear function with these values at the corners does not exceed on `share` of a piece.
double quantile(std::array<double, 3> value, int corners, double share) {
  std::sort(value.begin(), value.begin() + corners);
  const auto [a, b, c] = value;
  if (corners == number) return a;
  if (corners == length) return a + share * (b - a);
  if (share * (c - a) <= b - a) return a + std::sqrt(share * (b - a) * (c - a));
  return c - std::sqrt((1 - share) * (c - a) * (c - b));
}

/// Values of a bound over equal shares of a piece.
using Slices = std::array<double, kSlices>;

double sum_of(const Slices& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

/// A sum without the error that grows with the number of terms (Neumaier).
class Sum {
 public:
  void add(double x) {
    const double sum = sum_ + x;
    lost_ += std::abs(sum_) >= std::abs(x) ? (sum_ - sum) + x : (x - sum) + sum_;
    sum_ = sum;
  }
  double value() const { return sum_ + lost_; }

 private:
  double sum_ = 0, lost_ = 0;
};

/// The distribution of one number, 0 or more, over the weight of all pieces.
class Distribution {
 public:
  /// visit(piece, add) calls add(number, share of the piece) for the parts of a piece.
  template <class Visit>
  Distribution(const std::vector<Piece>& pieces, Visit&& visit) {
    for (const Piece& piece : pieces) {
      poll_at(parts_.size());
      if (!(piece.weight > 0)) continue;
      visit(piece, [&](double number, double share) { parts_.push_back({number, share * piece.weight}); });
    }
    for (const Part& part : parts_) largest_ = std::max(largest_, part.value);
    std::vector<Sum> bins(kBins);
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      poll_at(i);
      bins[bin_of(parts_[i].value)].add(parts_[i].weight);
    }
    Sum sum;
    for (const Sum& bin : bins) {
      before_.push_back(sum.value());
      sum.add(bin.value());
    }
    before_.push_back(sum.value());
  }

  double share_beyond(double bound) const {
    Sum sum;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      poll_at(i);
      if (parts_[i].value > bound) sum.add(parts_[i].weight);
    }
    return std::min(1.0, sum.value() / before_.back());
  }

  double percentile(double percent, double share_error = 0) const {
    const double wanted = (percent / 100 + share_error) * before_.back();
    const auto after = std::lower_bound(before_.begin() + 1, before_.end() - 1, wanted);
    std::size_t bin = std::size_t(after - before_.begin()) - 1;
    while (bin + 1 < kBins && before_[bin + 1] == before_[bin]) ++bin;  // an empty bin
    std::vector<Part> inside;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      poll_at(i);
      if (bin_of(parts_[i].value) == bin) inside.push_back(parts_[i]);
    }
    std::size_t compared = 0;
    std::sort(inside.begin(), inside.end(), [&](const Part& x, const Part& y) {
      poll_at(++compared);
      return x.value < y.value;
    });
    Sum sum;
    sum.add(before_[bin]);
    for (const Part& part : inside) {
      sum.add(part.weight);
      if (sum.value() >= wanted) return part.value;
    }
    return inside.empty() ? largest_ : inside.back().value;
  }

 private:
  // The parts are sorted only within the one of so many bins where a percentile is.
  static constexpr std::size_t kBins = 4096;

  struct Part {
    double value, weight;
  };

  std::size_t bin_of(double value) const {
    return largest_ > 0 ? std::min(kBins - 1, std::size_t(std::max(0.0, value) / largest_ * double(kBins))) : 0;
  }

  std::vector<Part> parts_;
  double largest_ = 0;
  std::vector<double> before_;  // the weight before each bin, and at last that of all
};

/// Returns the world mesh about the centre of the frame, as small as it takes for its volume, a sum of products of
/// three coordinates, not to overflow.
TriangleMesh for_volume(TriangleMesh mesh, const Frame& frame) {
  double largest = 0;
  std::size_t turn = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    poll_at(++turn);
    for (int k = 0; k < 3; ++k) {
      const dvec3 p = glm::abs(mesh.vertices[t[k]]);
      largest = std::max({largest, p.x, p.y, p.z});
    }
  }
  const double scale = std::min(frame.scale(), std::exp2(std::floor(kLargestExponent - std::log2(largest))));
  for (dvec3& p : mesh.vertices) p = p * scale - frame.centre() * scale;
  return mesh;
}

/// Tells whether a mesh in the frame is a point within rounding, as it is if the other one has corners very far away.
bool is_a_point(const TriangleMesh& mesh) {
  Box box;
  std::size_t turn = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    poll_at(++turn);
    for (int k = 0; k < 3; ++k) box.add(mesh.vertices[t[k]]);
  }
  return glm::distance(box.lower, box.upper) <= kPoint;
}

/// Returns b, or one triangle of it if b is a point: to every search all of its triangles would be about as near.
TriangleMesh searched(const TriangleMesh& b) {
  return is_a_point(b) ? TriangleMesh{b.vertices, {b.triangles.front()}} : b;
}

/// Tells inside from outside of a closed mesh. Nothing is inside of an open mesh. The normals are those of the part
/// that the distances are measured from. Its cuts are never nearest, and everywhere else it has the faces of the whole
/// mesh.
class SideOf {
 public:
  SideOf(const PlacedPair& pair, const TriangleMesh& world_b) : normals_(pair.b), point_(is_a_point(pair.b)) {
    known_ = pair.whole && !point_ ? normals_.closed() : is_closed(world_b);
    turn_ = enclosed_volume(pair.whole ? pair.b : for_volume(world_b, pair.frame)) < 0 ? -1 : 1;
  }

  bool known() const { return known_; }
  bool inside(const dvec3& p, const Hierarchy::Nearest& nearest) const {
    return known() && !point_ &&
           turn_ * glm::dot(p - nearest.point, normals_.at(nearest.triangle, nearest.weights)) < 0;
  }

 private:
  Pseudonormals normals_;
  bool known_;
  bool point_;  // tells whether b has no inside beyond rounding
  double turn_;
};

class Cover {
 public:
  /// `world_b` is the mesh that pair.b is a part of.
  Cover(const PlacedPair& pair, const TriangleMesh& world_b, const DeviationOptions& options)
      : b_(searched(pair.b)), hierarchy_(b_), sides_(pair, world_b), options_(options) {
    const TriangleMesh& a = pair.a;
    for (const Measure measure : {area, length, number}) {
      measure_ = measure;
      total_ = Sum();
      pieces_.clear();
      for (const glm::uvec3& t : a.triangles) {
        poll_at(pieces_.size());
        pieces_.push_back(
            {simplex_of({a.vertices[t.x], a.vertices[t.y], a.vertices[t.z]}, measure), 0, {}, 0, 0, false});
        total_.add(measure_of(pieces_.back().simplex));
      }
      if (total_.value() > 0) break;
    }
    std::vector<Piece> triangles;
    triangles.swap(pieces_);
    for (const Piece& triangle : triangles) {
      const double whole = measure_of(triangle.simplex), parts = whole / total_.value() * kPieces;
      const int k = std::max(1, int(std::lround(measure_ == area ? std::sqrt(parts) : parts)));
      const double share = measure_ == number ? 1 : 1.0 / (measure_ == area ? double(k) * k : k);
      cut(triangle.simplex, k, [&](const Simplex& part) {
        poll_at(pieces_.size());
        pieces_.push_back({part, whole * share, {}, 0, 0, false});
      });
    }
    budget_ = std::max({kBudget, kBudgetPerTriangle * a.triangles.size(), pieces_.size()});
    most_steps_ = std::size_t(options.steps * double(budget_));
  }

  void measure() {
    evaluate(pieces_, 0, true);
    while (measure_ != number && refine()) continue;
  }

  const std::vector<Piece>& pieces() const { return pieces_; }
  std::size_t steps() const { return steps_; }
  bool has_sides() const { return sides_.known(); }
  double spacing() const {
    if (measure_ == number) return 0;
    const double each = total_.value() / double(pieces_.size());
    return measure_ == area ? std::sqrt(each) : each;
  }

 private:
  /// Computes the bounds and points of these pieces, the first of which has the number `first`. Returns how many pieces
  /// it did. If all steps are used up it stops, or bounds the other pieces loosely if it must do `all`.
  std::size_t evaluate(std::span<Piece> pieces, std::size_t first, bool all) {
    std::size_t done = 0;
    while (done < pieces.size() && (all || steps_ < most_steps_)) {
      const std::size_t count = std::min(kChunk, pieces.size() - done);
      const bool loosely = steps_ >= most_steps_;
      std::atomic<std::size_t> steps = 0;
      parallel_for(count, kBlock, options_.threads, [&](std::size_t begin, std::size_t end) {
        std::uint32_t hint = Hierarchy::kNone;
        std::size_t made = 0;
        for (std::size_t i = done + begin; i < done + end; ++i) {
          Piece& piece = pieces[i];
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
      if (options_.progress) options_.progress->update(double(first + done) / double(budget_));
    }
    return done;
  }

  /// Cuts the worst pieces. Returns false if there is nothing more to gain or to spend.
  bool refine() {
    poll();
    Sum gap;
    double largest = 0;
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      poll_at(i);
      const Piece& piece = pieces_[i];
      gap.add(piece.gap());
      largest = std::max(largest, piece.distance);
    }
    const double enough = std::max(kEnough * largest, kNoise) * total_.value();
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
    std::vector<Piece> parts;
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
    std::erase_if(pieces_, [&](const Piece& piece) {
      poll_at(++seen);
      return piece.weight < 0;
    });
    for (std::size_t i = 0; i < (end.empty() ? 0 : end.back()); ++i) {
      poll_at(i);
      pieces_.push_back(parts[i]);
    }
    return !end.empty();
  }

  template <class Visit>
  void halve(const Piece& piece, Visit&& visit) const {
    if (measure_ == length) return cut(piece.simplex, 2, visit);
    const glm::uvec3& t = b_.triangles[piece.bounds.nearest];
    const TriangleCorners nearest{b_.vertices[t.x], b_.vertices[t.y], b_.vertices[t.z]};
    const Parts parts = split(piece.simplex.corner, nearest, nearest);
    for (int i = 0; i < parts.count; ++i) visit(Simplex{parts.corners[i], area});
  }

  const TriangleMesh b_;
  Hierarchy hierarchy_;
  SideOf sides_;
  const DeviationOptions& options_;
  Measure measure_ = number;
  Sum total_;
  std::size_t budget_ = 0, steps_ = 0, most_steps_ = 0;
  std::vector<Piece> pieces_;
};

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
Sides sides_of(const std::vector<Piece>& pieces) {
  Sum weight, mean, mean_lower, mean_upper, inside, inside_lower, inside_upper;
  Sides sides;
  for (const Piece& piece : pieces) {
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
  Cover cover(pair, b, options);
  cover.measure();
  const std::vector<Piece>& pieces = cover.pieces();

  Deviation result;
  Sum weight, mean, mean_lower, mean_upper, square, square_lower, square_upper, variance;
  for (const Piece& piece : pieces) {
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

  const Distribution seen(pieces, [](const Piece& piece, auto&& add) { add(piece.distance, 1); });
  const Distribution least(pieces, [](const Piece& piece, auto&& add) {
    Slices linear, quarters;
    for (int i = 0; i < kSlices; ++i) {
      linear[i] = quantile(piece.bounds.lower, piece.simplex.corners, double(i) / kSlices) - kNoise;
      quarters[i] = piece.bounds.quarters[i].lower;
    }
    const Slices& better = sum_of(linear) > sum_of(quarters) ? linear : quarters;
    for (const double at : better) add(std::max(piece.bounds.value.lower, at), 1.0 / kSlices);
  });
  const Distribution most(pieces, [](const Piece& piece, auto&& add) {
    Slices linear, quarters;
    for (int i = 0; i < kSlices; ++i) {
      linear[i] = quantile(piece.bounds.upper, piece.simplex.corners, double(i + 1) / kSlices) + kNoise;
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
  if (cover.has_sides()) {
    Sides& sides = result.sides.emplace(sides_of(pieces));
    for (double* length : {&sides.mean.value, &sides.mean.range.lower, &sides.mean.range.upper, &sides.inside.lower,
                           &sides.inside.upper, &sides.outside.lower, &sides.outside.upper}) {
      *length /= scale;
    }
  }
  for (const Piece& piece : pieces) {
    poll_at(result.distances.size());
    result.distances.push_back(piece.signed_distance() / scale);
    result.weights.push_back(piece.weight / whole);
  }
  result.spacing = cover.spacing() / scale;
  result.steps = cover.steps();
  if (options.progress) options.progress->update(1);
  return result;
}

}  // namespace tolvol
