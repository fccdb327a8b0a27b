// SPDX-License-Identifier: GPL-3.0-or-later
/// Any ToleranceCheck as the judge of a decimation's collapses: the ring's new faces, and nothing else, must be inside.
#pragma once

#include <memory>
#include <optional>

#include "check/ring_check.h"
#include "check/tolerance_check.h"

namespace tolvol::baselines {

class CheckedRing final : public RingCheck {
 public:
  /// Keeps a reference to `check`.
  explicit CheckedRing(const ToleranceCheck& check) : check_(&check) {}

  void begin(const TriangleMesh& mesh, const StoredSpace& space) override;
  /// Its trials ask the check one question for each collapse, its new faces a group, as [Botsch04, §5] has it.
  std::unique_ptr<Trial> trial() override;
  std::string method() const override { return check_->method(); }
  std::string renderer() const override { return check_->renderer(); }

 private:
  class Asking;

  const ToleranceCheck* check_;
  std::optional<StoredSpace> space_;
};

}  // namespace tolvol::baselines
