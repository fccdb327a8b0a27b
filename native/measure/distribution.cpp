// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/distribution.h"

#include <algorithm>
#include <utility>

#include "base/call.h"

namespace tolvol {

Distribution::Distribution(std::vector<Part> parts) : parts_(std::move(parts)) {
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

std::size_t Distribution::bin_of(double value) const {
  return largest_ > 0 ? std::min(kBins - 1, std::size_t(std::max(0.0, value) / largest_ * double(kBins))) : 0;
}

double Distribution::share_beyond(double bound) const {
  Sum sum;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    poll_at(i);
    if (parts_[i].value > bound) sum.add(parts_[i].weight);
  }
  return std::min(1.0, sum.value() / before_.back());
}

double Distribution::percentile(double percent, double share_error) const {
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

}  // namespace tolvol
