// SPDX-License-Identifier: GPL-3.0-or-later
#include "baselines/checked_ring.h"

namespace tolvol::baselines {

void CheckedRing::begin(const TriangleMesh&, double mapping_error) { mapping_error_ = mapping_error; }

bool CheckedRing::accepts(std::span<const Coverage::Element> faces, std::span<const Coverage::Removed>) {
  points_.clear();
  indices_.clear();
  groups_.clear();
  for (const Coverage::Element& face : faces) {
    if (face.moved == 0) continue;
    groups_.push_back(0);
    for (const glm::dvec3& corner : face.corners) {
      indices_.push_back(static_cast<std::uint32_t>(points_.size()));
      points_.push_back(corner);
    }
  }
  const std::vector<Verdict> verdicts =
      check_->check_groups({points_, indices_, 3, mapping_error_}, groups_, {.threads = 1});
  return verdicts.empty() || verdicts.front() == Verdict::inside;
}

}  // namespace tolvol::baselines
