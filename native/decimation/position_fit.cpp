// SPDX-License-Identifier: GPL-3.0-or-later
// The method is iteratively reweighted least squares for the p-norm of the deviations, with p = 6 (for large p it tends
// to the minimax fit; C. L. Lawson, "Contributions to the theory of linear least maximum approximation", 1961). A point
// at barycentric weight beta of the moving corner follows a step s of that corner by beta s, so that a deviation r
// becomes |r - beta s|, linearised along r. The sums take pieces of the reference against the faces, and points of the
// faces against the reference.
#include "decimation/position_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/call.h"
#include "geometry/closest_point.h"

namespace tolvol {
namespace {

/// Every kStride-th piece of an element is sampled. More samples lead to no fewer triangles.
constexpr std::size_t kStride = 24;
/// The number of samples between two polls.
constexpr std::size_t kBetweenPolls = 256;
/// The share of the trace that is added to the diagonal: the vertex stays along directions that nothing determines.
constexpr double kShareOfTrace = 1e-3;
/// The share of a face's area that each of its own points stands for.
constexpr double kFaceShare = 0.1;
/// Smaller shares of the tolerance count as this one, so that no deviation is divided by nothing.
constexpr double kLeastShare = 1e-3;
/// Points of a face: the weight of the moving corner, and the share of the other weights that the corner before it has.
constexpr double kFacePoints[][2] = {{1, 0},   {0.75, 0}, {0.75, 1}, {0.5, 0},     {0.5, 0.5},
                                     {0.5, 1}, {0.25, 0}, {0.25, 1}, {0.25, 0.33}, {0.25, 0.67}};

}  // namespace

struct PositionFit::Sums {
  double unit2;  ///< It is 1 / tolerance^2.
  double energy = 0, largest2 = 0;
  glm::dmat3 m{0};
  glm::dvec3 g{0};

  double deviation() const { return std::sqrt(largest2); }
  /// `share` is the share of the tolerance that the deviation may use. It counts by its root, because a fit still
  /// brings many deviations within a small share: where the share itself counted, 1 to 5 % more triangles remained.
  void add(const glm::dvec3& residual, double area, double beta, double share) {
    const double d2 = glm::dot(residual, residual), relative2 = d2 * unit2, weight = area * relative2 * relative2;
    energy += weight * relative2;
    largest2 = std::max(largest2, relative2 / share);
    if (!(d2 > 0) || !(beta > 0)) return;
    m += glm::outerProduct(residual, residual) * (weight * beta * beta / d2);
    g += residual * (weight * beta);
  }
};

void PositionFit::gather(const Change& change) {
  samples_.clear();
  const Coverage* const backward = bounds_->backward();
  if (!backward) return;
  for (const Coverage::Removed& r : change.removed()) backward->sample(r.id, kStride, samples_);
  for (const Coverage::Element& e : change.elements()) backward->sample(e.id, kStride, samples_);
}

void PositionFit::prepare(const Change& change) {
  faces_.clear();
  for (const Coverage::Element& e : change.elements()) {
    faces_.emplace_back(e.corners[0], e.corners[1], e.corners[2]);
  }
}

/// It ends at the first deviation beyond `most`, as add_faces() does.
void PositionFit::add_pieces(const Change& change, double most, Sums& sums) {
  for (std::size_t first = 0; first < samples_.size() && sums.deviation() <= most; first += 4) {
    const auto at = [&](std::size_t k) { return std::min(first + k, samples_.size() - 1); };
    if (first % kBetweenPolls == 0) poll();
    FourPoints points;
    looked_at_ += 4;
    points.set(samples_[at(0)].point, samples_[at(1)].point, samples_[at(2)].point, samples_[at(3)].point);
    double nearest[4];
    std::size_t face[4] = {};
    std::fill_n(nearest, 4, std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < faces_.size(); ++i) {
      double d2[4];
      witness_distances(faces_[i], points, d2);
      for (int k = 0; k < 4; ++k) {
        if (d2[k] < nearest[k]) nearest[k] = d2[k], face[k] = i;
      }
    }
    for (std::size_t k = 0; k < 4 && first + k < samples_.size(); ++k) {
      const Coverage::Sample& s = samples_[first + k];
      const WitnessTriangle& t = faces_[face[k]];
      const Change::Face& changed = change.faces()[face[k]];
      const ClosestPoint q = closest_point(s.point, t.a, t.a + t.ab, t.a + t.ac);
      sums.add(s.point - q.point, s.area, changed.moves ? q.weights[changed.corner] : 0, 1);
    }
  }
}

void PositionFit::add_faces(const Change& change, double most, Sums& sums) {
  for (std::size_t i = 0; i < faces_.size() && sums.deviation() <= most; ++i) {
    const WitnessTriangle& t = faces_[i];
    const glm::dvec3 corners[3] = {t.a, t.a + t.ab, t.a + t.ac};
    const Change::Face& face = change.faces()[i];
    const glm::dvec3 &p = corners[face.corner], &a = corners[(face.corner + 1) % 3],
                     &b = corners[(face.corner + 2) % 3];
    looked_at_ += std::size(kFacePoints);
    const double share = std::max(change.share(face), kLeastShare);
    const double area = 0.5 * kFaceShare * glm::length(glm::cross(t.ab, t.ac));
    for (const auto& [beta, along] : kFacePoints) {
      const glm::dvec3 x = beta * p + (1 - beta) * (along * b + (1 - along) * a);
      if (const auto q = bounds_->forward().nearby_point(x)) sums.add(*q - x, area, face.moves ? beta : 0, share);
    }
  }
}

PositionFit::Fit PositionFit::fit(const Change& change, const glm::dvec3& position, double most) {
  const double limit = bounds_->forward().limit();
  Sums sums{1 / (limit * limit)};
  prepare(change);
  add_pieces(change, most, sums);
  add_faces(change, most, sums);
  const double trace = sums.m[0][0] + sums.m[1][1] + sums.m[2][2];
  const double deviation = sums.deviation();
  if (!(trace > 0) || deviation > most) return {sums.energy, deviation, position};
  for (int i = 0; i < 3; ++i) sums.m[i][i] += kShareOfTrace * trace;
  glm::dvec3 step = glm::inverse(sums.m) * sums.g;
  const double length = glm::length(step);
  if (length > limit) step *= limit / length;
  return {sums.energy, deviation, position + step};
}

ChangeTrial::Outcome PositionFit::collapse(ChangeTrial& trial, Change::Halfedge h, const glm::dvec3& start,
                                           std::span<const double> give_up_above) {
  glm::dvec3 position = start;
  bool first = true;
  for (const double most : give_up_above) {
    if (!trial.prepare_collapse(h, mesh_->store(position))) return ChangeTrial::Outcome::impossible;
    if (std::exchange(first, false)) gather(trial.change());
    const Fit found = fit(trial.change(), position, most);
    if (found.deviation > most) break;
    position = found.position;
    const ChangeTrial::Outcome outcome = trial.try_collapse(h, mesh_->store(position));
    if (outcome != ChangeTrial::Outcome::refused) return outcome;
  }
  return ChangeTrial::Outcome::refused;
}

}  // namespace tolvol
