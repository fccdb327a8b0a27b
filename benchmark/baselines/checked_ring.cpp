// SPDX-License-Identifier: GPL-3.0-or-later
#include "baselines/checked_ring.h"

#include "check/changed_faces.h"

namespace tolvol::baselines {

void CheckedRing::begin(const TriangleMesh&, const StoredSpace& space) { space_ = space; }

class CheckedRing::Asking final : public Trial {
 public:
  explicit Asking(const CheckedRing& ring) : ring_(ring) {}
  bool accepts(const ChangedFaces& change) override {
    points_.clear();
    indices_.clear();
    groups_.clear();
    for (const Coverage::Element& face : change.elements()) {
      if (face.moved == 0) continue;
      groups_.push_back(0);
      for (const glm::dvec3& corner : face.corners) {
        indices_.push_back(static_cast<std::uint32_t>(points_.size()));
        points_.push_back(ring_.space_->store(corner));
      }
    }
    const std::vector<Verdict> verdicts =
        ring_.check_->check_groups({points_, *ring_.space_, indices_}, groups_, {.threads = 1});
    return verdicts.empty() || verdicts.front() == Verdict::inside;
  }
  void commit(const ChangedFaces&) override {}

 private:
  const CheckedRing& ring_;
  std::vector<glm::dvec3> points_;
  std::vector<std::uint32_t> indices_;
  std::vector<std::int32_t> groups_;
};

std::unique_ptr<Bounds::Trial> CheckedRing::trial() { return std::make_unique<Asking>(*this); }

}  // namespace tolvol::baselines
