// SPDX-License-Identifier: GPL-3.0-or-later
/// Any ToleranceCheck as the judge of a decimation's collapses: the ring's new faces, and nothing else, must be inside.
#pragma once

#include "check/ring_check.h"
#include "check/tolerance_check.h"

namespace tolvol::baselines {

class CheckedRing final : public RingCheck {
 public:
  /// Keeps a reference to `check`.
  explicit CheckedRing(const ToleranceCheck& check) : check_(&check) {}

  void begin(const TriangleMesh& mesh, double mapping_error) override;
  /// One question of the check for each collapse, its new faces a group, as [Botsch04, §5] has it.
  bool accepts(std::span<const Coverage::Element> faces, std::span<const Coverage::Removed> removed) override;
  std::string method() const override { return check_->method(); }
  std::string renderer() const override { return check_->renderer(); }

 private:
  const ToleranceCheck* check_;
  double mapping_error_ = 0;
  std::vector<glm::dvec3> points_;
  std::vector<std::uint32_t> indices_;
  std::vector<std::int32_t> groups_;
};

}  // namespace tolvol::baselines
