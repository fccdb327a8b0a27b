// SPDX-License-Identifier: GPL-3.0-or-later
#include "baselines/checked_ring.h"

#include <algorithm>

namespace tolvol::baselines {

void CheckedRing::begin(const TriangleMesh&, double mapping_error) { mapping_error_ = mapping_error; }

bool CheckedRing::accepts(std::span<const Coverage::Element> faces, std::span<const Coverage::Removed>) {
  points_.clear();
  indices_.clear();
  for (const Coverage::Element& face : faces) {
    if (face.moved == 0) continue;
    for (const glm::dvec3& corner : face.corners) {
      indices_.push_back(static_cast<std::uint32_t>(points_.size()));
      points_.push_back(corner);
    }
  }
  const std::vector<Verdict> verdicts = check_->check({points_, indices_, 3, mapping_error_}, {.threads = 1});
  return std::all_of(verdicts.begin(), verdicts.end(), [](Verdict v) { return v == Verdict::inside; });
}

}  // namespace tolvol::baselines
