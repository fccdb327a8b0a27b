// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/edge_flips.h"

#include <algorithm>
#include <limits>

#include "decimation/is_turned.h"

namespace tolvol {
namespace {

/// The normals that a flip leaves differ from the mean before by less than the angle of this cosine.
constexpr double kFlipCosine = 0.2;
/// An edge is flipped where that leaves less than this share of the energy.
constexpr double kFlipGain = 0.99;

bool folds(const Patch& patch, const Patch::Flipped& flipped) {
  glm::dvec3 before(0);
  for (const std::uint32_t f : flipped.face) before += patch.normal(f);
  return std::ranges::any_of(flipped.corners,
                             [&](const auto& c) { return is_turned(before, patch.normal(c), kFlipCosine); });
}

}  // namespace

double EdgeFlips::energy_now(const PatchDeviations& deviations, const Patch::Flipped& flipped) const {
  double energy = 0;
  for (const std::uint32_t f : flipped.face) {
    for (const std::uint32_t i : points_of_[f]) energy += deviations.energy(i);
  }
  return energy;
}

/// The energy of the points near two faces if these were flipped, or a larger number than `limit`.
double EdgeFlips::energy_if(const PatchDeviations& deviations, const Patch::Flipped& flipped, double limit) const {
  double energy = 0;
  for (const std::uint32_t f : flipped.face) {
    for (const std::uint32_t i : points_of_[f]) {
      double square = std::numeric_limits<double>::infinity();
      for (const auto& c : flipped.corners) square = std::min(square, deviations.square_from(i, c));
      energy += deviations.energy(i, square);
      if (energy > limit) return energy;
    }
  }
  return energy;
}

bool EdgeFlips::flip(PatchDeviations& deviations) {
  Patch& patch = deviations.patch();
  points_of_.resize(std::max(points_of_.size(), patch.faces().size()));
  for (auto& points : points_of_) points.clear();
  for (std::uint32_t i = 0; i < deviations.reference_count(); ++i) {
    points_of_[deviations.terms()[i].face].push_back(i);
  }
  bool any = false;
  for (std::uint32_t f = 0; f < patch.faces().size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      Patch::Flipped flipped;
      const std::uint32_t other = patch.faces()[f].across[k];
      if (other == Patch::kNone || other < f || !patch.can_flip(f, k, flipped) || folds(patch, flipped)) continue;
      const double limit = kFlipGain * energy_now(deviations, flipped);
      if (!(energy_if(deviations, flipped, limit) < limit)) continue;
      patch.flip(flipped);
      any = true;
      std::vector<std::uint32_t> points = points_of_[f];
      points.insert(points.end(), points_of_[other].begin(), points_of_[other].end());
      points_of_[f].clear(), points_of_[other].clear();
      for (const std::uint32_t i : points) points_of_[deviations.take_nearer(i, f, other)].push_back(i);
    }
  }
  if (any) deviations.renew_after_flips();
  return any;
}

bool EdgeFlips::flip_near(PatchDeviations& deviations, std::uint32_t vertex, int place) {
  Patch& patch = deviations.patch();
  const std::vector<std::uint32_t>& around = patch.vertices()[vertex].faces;
  for (const std::uint32_t f : around) {
    for (int k = 0; k < 3; ++k) {
      Patch::Flipped flipped;
      const std::uint32_t other = patch.faces()[f].across[k];
      if (other == Patch::kNone || !patch.can_flip(f, k, flipped) || folds(patch, flipped)) continue;
      const bool was_seen = other < f && std::ranges::find(around, other) != around.end();
      if (was_seen || place-- > 0) continue;
      patch.flip(flipped);
      deviations.renew_after_flips();
      return true;
    }
  }
  return false;
}

}  // namespace tolvol
