// SPDX-License-Identifier: GPL-3.0-or-later
/// The check as it was published [Botsch04, §4] is fast, and not conservative. It is here for comparison;
/// occlusion_query.h is the check that proves.
///
/// A candidate is drawn as the triangle (0, 0), (l, 0), (0, l), l = ceil(longest edge / h), with an 8-bit distance
/// texture that the hardware interpolates. Pixels farther than eps' are counted, and a candidate with one such pixel is
/// outside. Candidates are accepted wrongly because corners and whole candidates of one pixel are not drawn, because
/// points are up to h / sqrt(3) away from their samples and, with half_spacing, because of the interpolation.
#pragma once

#include <optional>

#include "check/sampled_check.h"
#include "field/distance_texture.h"

namespace tolvol {

class Paper final : public SampledCheck {
 public:
  /// The margin is taken off the tolerance, because the interpolation may underestimate the distance. It is
  /// (sqrt(3)/2) h, or the h/2 that "turned out to be sufficient".
  enum class Margin { half_diagonal, half_spacing };

  /// Keeps a reference to `volume`, which must outlive this. Throws InvalidInput if the margin leaves nothing of the
  /// tolerance, and names a sufficient precision; ResourceLimit if the grid is too large for a texture; and
  /// GlUnavailable.
  Paper(const ToleranceVolume& volume, Margin margin);
  std::string method() const override;

 private:
  float bound(double mapping_error) const override;
  bool add_triangle_samples(const Corners& corners, std::uint32_t counter,
                            std::vector<SampledTriangle>& triangles) const override;
  void use(const gl::Program& program, float bound) const override;
  const Programs& programs() const override;
  Verdict verdict(std::uint64_t counted, std::uint64_t points) const override;

  Margin margin_;
  double largest_ = 0;  // the largest side of a framebuffer, in pixels
  std::optional<DistanceTexture> texture_;
};

}  // namespace tolvol
