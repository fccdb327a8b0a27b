// SPDX-License-Identifier: GPL-3.0-or-later
/// The paper's check by occlusion queries [Botsch04, §4], made conservative.
///
/// A candidate is drawn so that its pixels are evenly spaced samples of it. An edge has n subdivisions, and their
/// spacing is at most that of the grid. The samples at which the interpolated distance is at most eps' are counted. A
/// candidate is inside only if all samples were counted, so that nothing is proved that was not drawn. Any other
/// candidate is unproved; the verdict is never outside. The distance at a node is the exact distance of the triangle
/// that the grid names for it. A grid that was filled by fast marching names few triangles, so that little is proved
/// with it.
#pragma once

#include <optional>

#include "check/sampled_check.h"
#include "field/distance_texture.h"

namespace tolvol {

class OcclusionQuery final : public SampledCheck {
 public:
  /// Keeps a reference to `volume`, which must outlive this. Throws InvalidInput if the grid is too coarse, and names a
  /// sufficient precision: eps' is eps - 1.44 h less the rounding of float32, so that 4 is good and 1.45 useless.
  /// Throws ResourceLimit if the grid is too large for a texture, and GlUnavailable. O(nodes).
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
