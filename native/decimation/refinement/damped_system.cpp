// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/damped_system.h"

#include <cmath>

#include "base/simd.h"

namespace tolvol {
namespace {

/// The share of the mean of the diagonal, times the damping, that is added to the diagonal beside the damped diagonal.
constexpr double kMeanShare = 0.1;

/// Subtracts from column j of a matrix of n columns what the factors in the columns before it contribute, in the order
/// of these columns. The entries of a column do not depend on each other, so that several are computed at once.
TOLVOL_INLINE void subtract_columns_inline(double* matrix, std::size_t n, std::size_t j) {
  double* const column = matrix + j * n;
  std::size_t k = 0;
  for (; k + 4 <= j; k += 4) {
    const double *const a = matrix + k * n, *const b = a + n, *const c = b + n, *const d = c + n;
    const double of_a = a[j], of_b = b[j], of_c = c[j], of_d = d[j];
#pragma GCC ivdep
    for (std::size_t i = j; i < n; ++i) {
      column[i] = column[i] - a[i] * of_a - b[i] * of_b - c[i] * of_c - d[i] * of_d;
    }
  }
  for (; k < j; ++k) {
    const double* const a = matrix + k * n;
    const double of_a = a[j];
#pragma GCC ivdep
    for (std::size_t i = j; i < n; ++i) column[i] -= a[i] * of_a;
  }
}

void subtract_columns(double* matrix, std::size_t n, std::size_t j) { subtract_columns_inline(matrix, n, j); }
TOLVOL_TARGET_AVX2 void subtract_columns_avx2(double* matrix, std::size_t n, std::size_t j) {
  subtract_columns_inline(matrix, n, j);
}

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
  const auto subtract = simd_path() == Simd::avx2 ? subtract_columns_avx2 : subtract_columns;
  for (std::size_t j = 0; j < n; ++j) {
    double* const column = &factor_[j * n];
    subtract(factor_.data(), n, j);
    if (!(column[j] > 0)) return false;
    column[j] = std::sqrt(column[j]);
    solution_[j] /= column[j];
    for (std::size_t i = j + 1; i < n; ++i) {
      column[i] /= column[j];
      solution_[i] -= column[i] * solution_[j];
    }
  }
  for (std::size_t i = n; i-- > 0;) {
    solution_[i] /= factor_[i * n + i];
    for (std::size_t k = 0; k < i; ++k) solution_[k] -= factor_[k * n + i] * solution_[i];
  }
  return true;
}

}  // namespace tolvol
