// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/sampled_piece.h"

#include <cmath>

namespace tolvol {

using glm::dvec3;

namespace {

/// Returns 0 <= u < 1 that is as good as random: the finaliser of SplitMix64 on the n-th odd multiple of the golden
/// ratio.
double uniform(std::uint64_t n) {
  n = (n + 1) * 0x9E3779B97F4A7C15u;
  n = (n ^ (n >> 30)) * 0xBF58476D1CE4E5B9u;
  n = (n ^ (n >> 27)) * 0x94D049BB133111EBu;
  return double((n ^ (n >> 31)) >> 11) * 0x1p-53;
}

}  // namespace

double measure_of(const Simplex& s) {
  const auto& p = s.corner;
  if (s.corners == kArea) return 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
  return s.corners == kLength ? glm::distance(p[0], p[1]) : 1;
}

Simplex simplex_of(const std::array<dvec3, 3>& p, Measure measure) {
  Simplex s{p, measure};
  if (measure != kLength) return s;
  for (int i = 1; i < 3; ++i) {
    const dvec3 &from = p[i], &to = p[(i + 1) % 3];
    if (glm::distance(from, to) > glm::distance(s.corner[0], s.corner[1])) s.corner = {from, to, to};
  }
  return s;
}

dvec3 weights_in(const Simplex& s, std::uint64_t n) {
  if (s.corners == kNumber) return {1, 0, 0};
  const double u = uniform(2 * n), v = uniform(2 * n + 1);
  if (s.corners == kLength) return {1 - u, u, 0};
  const double root = std::sqrt(u);
  return {1 - root, root * (1 - v), root * v};
}

double SampledPiece::corrected(const glm::dvec3& weights) const {
  if (!(bounds.room(simplex.corners) < bounds.value.upper - bounds.value.lower)) return distance;
  double middle = 0, mean = 0;
  for (int i = 0; i < simplex.corners; ++i) {
    const double at = 0.5 * (bounds.lower[i] + bounds.upper[i]);
    middle += weights[i] * at;
    mean += at / simplex.corners;
  }
  return distance - middle + mean;
}

}  // namespace tolvol
