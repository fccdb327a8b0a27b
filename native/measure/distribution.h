// SPDX-License-Identifier: GPL-3.0-or-later
/// Sums and distributions of numbers that belong to weighted pieces of a surface.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace tolvol {

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

/// The distribution of one number, 0 or more, over a total weight.
class Distribution {
 public:
  struct Part {
    double value, weight;
  };

  /// Takes the parts, in any order. The sum of their weights must be above 0. Throws Cancelled, as the functions below.
  /// About 10 ns a part.
  explicit Distribution(std::vector<Part> parts);

  /// Returns the share of the weight that belongs to numbers above the bound.
  double share_beyond(double bound) const;
  /// Returns the least number that so many per cent of the weight do not exceed. `share_error` is added to their share.
  double percentile(double percent, double share_error = 0) const;

 private:
  // The parts are counted in this many bins. They are sorted only within the bin in which a percentile is.
  static constexpr std::size_t kBins = 4096;

  std::size_t bin_of(double value) const;

  std::vector<Part> parts_;
  double largest_ = 0;
  std::vector<double> before_;  // the weight before each bin, and at last that of all
};

}  // namespace tolvol
