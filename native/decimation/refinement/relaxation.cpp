// SPDX-License-Identifier: GPL-3.0-or-later
// The energy is the sum of w (d / tolerance)^p over points of both surfaces, d the distance from a point to the other
// surface. A point of a face at barycentric coordinates b follows the corners x_i of the face by sum b_i x_i, so that
// with the residual r = d u, |u| = 1, the gradient with respect to x_i is -w p d^(p-2) b_i r, and the matrix
// p (p-1) w d^(p-2) b_i b_j u u^T is the leading part of the second derivative. The steps are those of K. Levenberg and
// D. Marquardt. A Newton step lowers a deviation to (p-2) / (p-1) of itself alone, so that steps are made longer as
// long as they succeed. A large p approaches the minimax fit.
#include "decimation/refinement/relaxation.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "base/call.h"
#include "decimation/is_turned.h"

namespace tolvol {
namespace {

/// The powers of the energy after the first one, PatchDeviations::kPower.
constexpr int kLargestPower = 24, kFinalPower = 96;
/// The last power is used if the deviation is less than kNearlyEnough tolerances, and for at most kFinalSteps steps.
constexpr double kNearlyEnough = 1.06;
constexpr int kFinalSteps = 20;
/// The largest deviation, over the tolerance, from which a success may still come before the first, second, ... step.
/// Of 621 successes 97 in 100 kept to it.
constexpr double kGiveUpAbove[] = {9, 2.1, 2.1, 2.1, 2.1, 1.33, 1.33, 1.33, 1.33, 1.26, 1.26, 1.26, 1.26, 1.17};
/// The same limits for try_lower_largest(): the first list for kLargestPower, the second for kFinalPower. Of 250
/// successes 97 in 100 kept to them.
constexpr double kGiveUpAgainAbove[] = {1.35, 1.35, 1.2, 1.2, 1.15, 1.15, 1.09, 1.09, 1.05, 1.05};
constexpr double kGiveUpAtLastAbove[] = {1.06, 1.06, 1.03, 1.03, 1.03, 1.01, 1.01, 1.01, 1.01, 1.01,
                                         1.01, 1.01, 1.01, 1.01, 1.01, 1.01, 1.01, 1.01, 1.01, 1.01};
/// Damping of the first step, and its factors after a step that lowered the energy and one that did not.
constexpr double kDamping = 1e-2, kLessDamping = 0.5, kMoreDamping = 5, kMostDamping = 1e4;
/// A step is made longer by the factor kOverstep at first. A success multiplies the factor by kLonger, a failure by
/// kShorter.
constexpr double kOverstep = 1.5, kLonger = 1.15, kShorter = 0.6;
/// A vertex moves at most by this share of its shortest edge in one step.
constexpr double kMostMove = 0.3;
/// A normal turns by less than the angle of the first cosine in one step, and the normals at an edge do not come to
/// differ by more than the angle of the second.
constexpr double kTurnCosine = 0.3, kEdgeCosine = -0.8;
/// Vertices whose faces turn too far go half the way at most kMostHalvings - 1 times, and then back.
constexpr int kMostHalvings = 4;
/// Edges are flipped before one step in kFlipEvery.
constexpr int kFlipEvery = 4;
/// A step leaves out the points whose energy is less than this share of that of the largest deviation.
constexpr double kLeftOut = 1e-4;
/// One step in kLookAroundEvery looks around for nearer faces.
constexpr int kLookAroundEvery = 3;

/// The cosine of the angle between two normals; 1 where one has no direction.
double cosine_of(const glm::dvec3& a, const glm::dvec3& b) {
  const double lengths2 = glm::dot(a, a) * glm::dot(b, b);
  return lengths2 > 0 ? glm::dot(a, b) / std::sqrt(lengths2) : 1;
}

}  // namespace

bool Relaxation::lower_sum(PatchDeviations& deviations, int steps, bool flip) {
  minimise(deviations, steps, flip, kGiveUpAbove);
  const std::size_t last = std::min(static_cast<std::size_t>(steps), std::size(kGiveUpAbove)) - 1;
  return deviations.state().largest <= kGiveUpAbove[last];
}

void Relaxation::lower_largest(PatchDeviations& deviations, int steps) { lower_largest(deviations, steps, {}, {}); }

void Relaxation::try_lower_largest(PatchDeviations& deviations, int steps) {
  lower_largest(deviations, steps, kGiveUpAgainAbove, kGiveUpAtLastAbove);
}

void Relaxation::lower_largest(PatchDeviations& deviations, int steps, std::span<const double> give_up_above,
                               std::span<const double> give_up_at_last) {
  deviations.set_power(kLargestPower);
  minimise(deviations, steps, true, give_up_above);
  if (!deviations.enough() && deviations.state().largest < kNearlyEnough) {
    deviations.set_power(kFinalPower);
    minimise(deviations, kFinalSteps, true, give_up_at_last);
  }
  deviations.set_power(PatchDeviations::kPower);
}

void Relaxation::minimise(PatchDeviations& deviations, int steps, bool flip, std::span<const double> give_up_above) {
  number_unknowns(deviations.patch());
  damping_ = kDamping, overstep_ = kOverstep;
  for (int i = 0; i < steps && !deviations.enough(); ++i) {
    poll();
    const auto place = static_cast<std::size_t>(i);
    if (place < give_up_above.size() && deviations.state().largest > give_up_above[place]) return;
    const bool flipped = flip && i % kFlipEvery == kFlipEvery - 1 && flips_.flip(deviations);
    if (!step(deviations, i % kLookAroundEvery == 0) && !flipped && damping_ > kMostDamping) return;
  }
}

void Relaxation::number_unknowns(const Patch& patch) {
  free_.clear(), unknown_.clear();
  for (std::uint32_t v = 0; v < patch.vertices().size(); ++v) {
    const bool free = patch.vertices()[v].free;
    unknown_.push_back(free ? static_cast<std::uint32_t>(free_.size()) : Patch::kNone);
    if (free) free_.push_back(v);
  }
}

/// Takes one step if it lowers the energy, and returns whether it does.
bool Relaxation::step(PatchDeviations& deviations, bool look_around) {
  assemble(deviations);
  if (free_.empty() || !system_.solve(damping_)) return false;
  Patch& patch = deviations.patch();
  const auto vertices = patch.vertices();
  before_.clear(), normals_.clear();
  for (const std::uint32_t v : free_) before_.push_back(vertices[v].position);
  for (std::uint32_t f = 0; f < patch.faces().size(); ++f) normals_.push_back(patch.normal(f));
  std::vector<glm::dvec3> after;
  for (std::size_t i = 0; i < free_.size(); ++i) {
    glm::dvec3 move = overstep_ * system_[i];
    double shortest2 = std::numeric_limits<double>::infinity();
    for (const std::uint32_t f : vertices[free_[i]].faces) {
      for (const std::uint32_t v : patch.faces()[f].corners) {
        if (v == free_[i]) continue;
        const glm::dvec3 d = vertices[v].position - before_[i];
        shortest2 = std::min(shortest2, glm::dot(d, d));
      }
    }
    const double most = kMostMove * std::sqrt(shortest2), length = glm::length(move);
    if (length > most) move *= most / length;
    after.push_back(before_[i] + move);
  }
  if (place_unturned(patch, after) && deviations.renew_if_lower(look_around)) {
    damping_ *= kLessDamping;
    overstep_ = std::min(overstep_ * kLonger, static_cast<double>(deviations.power() - 1));
    return true;
  }
  for (std::size_t i = 0; i < free_.size(); ++i) vertices[free_[i]].position = before_[i];
  damping_ *= kMoreDamping;
  overstep_ = std::max(overstep_ * kShorter, 1.0);
  return false;
}

/// Puts the free vertices at these places, and those that would turn a face or an edge too far at half the way, as
/// often as it takes. Returns whether it comes to places where nothing turns too far.
bool Relaxation::place_unturned(Patch& patch, std::vector<glm::dvec3>& places) {
  const auto vertices = patch.vertices();
  for (int halvings = 0; halvings <= kMostHalvings; ++halvings) {
    for (std::size_t i = 0; i < free_.size(); ++i) vertices[free_[i]].position = places[i];
    turned_.assign(vertices.size(), false);
    if (!find_turned(patch)) return true;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      if (turned_[free_[i]]) places[i] = halvings + 1 < kMostHalvings ? 0.5 * (places[i] + before_[i]) : before_[i];
    }
  }
  return false;
}

/// Notes in turned_ the vertices of the faces that have turned too far since normals_.
bool Relaxation::find_turned(const Patch& patch) {
  new_normals_.clear();
  bool any = false;
  const auto note = [&](std::uint32_t face) {
    any = true;
    for (const std::uint32_t v : patch.faces()[face].corners) turned_[v] = true;
  };
  for (std::uint32_t f = 0; f < patch.faces().size(); ++f) {
    new_normals_.push_back(patch.normal(f));
    if (glm::dot(normals_[f], normals_[f]) > 0 && is_turned(normals_[f], new_normals_[f], kTurnCosine)) note(f);
  }
  for (std::uint32_t f = 0; f < patch.faces().size(); ++f) {
    for (const std::uint32_t other : patch.faces()[f].across) {
      if (other == Patch::kNone || other < f) continue;
      if (cosine_of(new_normals_[f], new_normals_[other]) < kEdgeCosine &&
          cosine_of(normals_[f], normals_[other]) >= kEdgeCosine) {
        note(f), note(other);
      }
    }
  }
  return any;
}

/// Sums up the gradient and the matrix, in units of the tolerance.
void Relaxation::assemble(const PatchDeviations& deviations) {
  system_.start(free_.size());
  const double least = deviations.square_at(kLeftOut);
  for (std::size_t i = 0; i < deviations.terms().size(); ++i) {
    const PatchDeviations::Term& t = deviations.terms()[i];
    if (t.square < least) continue;
    const double force = deviations.force(i), length2 = glm::dot(t.residual, t.residual);
    if (!(force > 0) || !(length2 > 0)) continue;
    const double stiffness = force * (deviations.power() - 1) / length2;
    const auto& corners = deviations.corners(i);
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t p = unknown_[corners[k]];
      const double bk = t.weights[k];
      if (p == Patch::kNone || !(bk > 0)) continue;
      system_.add(p, force * bk * t.residual);
      for (int l = 0; l < 3; ++l) {
        const std::uint32_t q = unknown_[corners[l]];
        if (q != Patch::kNone && q <= p) system_.add(p, q, stiffness * bk * t.weights[l], t.residual);
      }
    }
  }
}

}  // namespace tolvol
