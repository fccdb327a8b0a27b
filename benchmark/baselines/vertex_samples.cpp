// SPDX-License-Identifier: GPL-3.0-or-later
// The product's own bookkeeping of the backward direction, over points instead of triangles: lists of samples on faces,
// handed on at each collapse, measured only where the bound on a list is used up. The original measures every sample
// each time and keeps it with its nearest face; this is the same decision, faster.
#include "baselines/vertex_samples.h"

#include "check/changed_faces.h"

namespace tolvol::baselines {

void VertexSamples::begin(const TriangleMesh& mesh, const StoredSpace&) {
  points_.vertices = mesh.vertices;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) points_.triangles.emplace_back(v);
  samples_.emplace(points_, tolerance_, mesh.triangles.size());
  std::vector<bool> placed(mesh.vertices.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = mesh.triangles[t][k];
      if (!placed[v]) samples_->set_witness(t, v);
      placed[v] = true;
    }
  }
}

class VertexSamples::Asking final : public Trial {
 public:
  explicit Asking(Coverage& samples) : samples_(samples) {}
  void begin() override { trial_.begin(); }
  bool accepts(const ChangedFaces& change) override {
    return samples_.try_change(change.elements(), change.removed(), trial_);
  }
  void commit(const ChangedFaces&) override { samples_.commit(trial_); }

 private:
  Coverage& samples_;
  Coverage::Trial trial_;
};

std::unique_ptr<Bounds::Trial> VertexSamples::trial() { return std::make_unique<Asking>(*samples_); }

}  // namespace tolvol::baselines
