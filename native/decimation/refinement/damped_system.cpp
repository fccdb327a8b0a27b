// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/damped_system.h"

#include <cmath>

namespace tolvol {
namespace {

/// The share of the mean of the diagonal, times the damping, that is added to the diagonal beside the damped diagonal.
constexpr double kMeanShare = 0.1;

}  // namespace

void DampedSystem::start(std::size_t vertices) {
  const std::size_t n = 3 * vertices;
  matrix_.assign(n * n, 0), right_.assign(n, 0);
}

/// By Cholesky's factors. The order of all sums is fixed, so that every platform gets one result.
bool DampedSystem::solve(double damping) {
  const std::size_t n = right_.size();
  double trace = 0;
  for (std::size_t i = 0; i < n; ++i) trace += matrix_[i * n + i];
  if (!(trace > 0)) return false;
  factor_ = matrix_;
  for (std::size_t i = 0; i < n; ++i) {
    double& d = factor_[i * n + i];
    d += damping * (d + kMeanShare * trace / static_cast<double>(n));
  }
  solution_ = right_;
  for (std::size_t i = 0; i < n; ++i) {
    double* const row = &factor_[i * n];
    for (std::size_t j = 0; j <= i; ++j) {
      const double* const other = &factor_[j * n];
      double sum = row[j];
      for (std::size_t k = 0; k < j; ++k) sum -= row[k] * other[k];
      if (j < i) {
        row[j] = sum / other[j];
      } else {
        if (!(sum > 0)) return false;
        row[i] = std::sqrt(sum);
      }
    }
    double sum = solution_[i];
    for (std::size_t k = 0; k < i; ++k) sum -= row[k] * solution_[k];
    solution_[i] = sum / row[i];
  }
  for (std::size_t i = n; i-- > 0;) {
    solution_[i] /= factor_[i * n + i];
    for (std::size_t k = 0; k < i; ++k) solution_[k] -= factor_[i * n + k] * solution_[i];
  }
  return true;
}

}  // namespace tolvol
