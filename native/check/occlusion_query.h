// SPDX-License-Identifier: GPL-3.0-or-later
/// The paper's check by occlusion queries [Botsch04, §4], made conservative.
///
/// A candidate is drawn so that its pixels are evenly spaced samples of it, n subdivisions an edge, spacing at most
/// that of the grid; the points at which the interpolated distance is at most eps' are counted. Inside only if all of
/// them were: whatever is not drawn is not proved. The rest is unproved; outside is never claimed. A node counts with
/// the exact distance of the triangle that the grid names for it; of a grid filled by fast marching, which names few,
/// little is proved.
#pragma once

#include <optional>

#include "check/sampled_check.h"
#include "field/distance_texture.h"

namespace tolvol {

class OcclusionQuery final : public SampledCheck {
 public:
  /// Keeps a reference to `volume`, which must outlive this. Throws InvalidInput when the grid is too coarse, naming
  /// the precision that will do: eps' is eps - 1.44 h less the rounding of float32, so 4 is good and 1.45 useless;
  /// ResourceLimit when the grid is too large for a texture; GlUnavailable. O(nodes).
  explicit OcclusionQuery(const ToleranceVolume& volume);
  std::string method() const override { return "occlusion_query"; }

 private:
  float bound(double mapping_error) const override;
  bool add_triangle_samples(const Corners& corners, std::uint32_t counter,
                            std::vector<SampledTriangle>& triangles) const override;
  void use(const gl::Program& program, float bound) const override;
  const Programs& programs() const override;
  Verdict verdict(std::uint64_t counted, std::uint64_t points) const override;

  std::optional<DistanceTexture> texture_;
};

}  // namespace tolvol
