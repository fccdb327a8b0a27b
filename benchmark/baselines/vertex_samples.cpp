// SPDX-License-Identifier: GPL-3.0-or-later
// The product's own bookkeeping of the backward direction, over points instead of triangles: lists of samples on faces,
// handed on at each collapse, measured only where the bound on a list is used up. The original measures every sample
// each time and keeps it with its nearest face; this is the same decision, faster.
#include "baselines/vertex_samples.h"

namespace tolvol::baselines {

void VertexSamples::begin(const TriangleMesh& mesh, double) {
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

}  // namespace tolvol::baselines
