// SPDX-License-Identifier: GPL-3.0-or-later
/// The check as it was published [Botsch04, §4]: fast, and not conservative. For comparison; occlusion_query.h is the
/// one that proves.
///
/// A candidate is drawn as the triangle (0, 0), (l, 0), (0, l), l = ceil(longest edge / h), with an 8-bit distance
/// texture that the hardware interpolates, and pixels farther than eps' are counted; any is outside. Wrong accepts come
/// from what is not drawn (corners; whole candidates of one pixel), from samples as far apart as h / sqrt(3) from what
/// they stand for, and, with half_spacing, from the interpolation.
#pragma once

#include <optional>

#include "check/sampled_check.h"
#include "field/distance_texture.h"

namespace tolvol {

class Paper final : public SampledCheck {
 public:
  /// What the interpolation may under-estimate, taken off the tolerance: (sqrt(3)/2) h, or the h/2 that "turned out to
  /// be sufficient".
  enum class Margin { half_diagonal, half_spacing };

  /// Keeps a reference to `volume`, which must outlive this. Throws InvalidInput when the margin leaves nothing of the
  /// tolerance, naming the precision that will do; ResourceLimit when the grid is too large for a texture;
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
  double largest_ = 0;  // side of a framebuffer
  std::optional<DistanceTexture> texture_;
};

}  // namespace tolvol
