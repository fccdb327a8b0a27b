// SPDX-License-Identifier: GPL-3.0-or-later
// This follows [Botsch04, §4] as printed, except that a candidate larger than a framebuffer stays unproved. The
// distances are those of the volume's grid, whichever way it was filled, with signs.
#include "check/paper.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "base/errors.h"
#include "gl/context.h"

namespace tolvol {
namespace {

/// A large candidate with a corner beyond the grid is outside whatever its other pixels are, so that only its pixels at
/// the corner are drawn, this many along an edge.
constexpr float kCorner = 16;

}  // namespace

Paper::Paper(const ToleranceVolume& volume, Margin margin) : SampledCheck(volume, 0), margin_(margin) {
  bound(0);  // this throws before any work if the grid is too coarse
  const std::vector<float> distances = volume.signed_distance();
  gl::run([&] {
    texture_.emplace(volume.grid(), distances, volume.frame_tolerance(), TextureFormat::normalised8);
    texture_->filter_linearly();
    largest_ = gl::Framebuffer::largest();
    programs();
  });
}

std::string Paper::method() const {
  return margin_ == Margin::half_diagonal ? "paper (not conservative)" : "paper, h/2 (not conservative)";
}

float Paper::bound(double) const {
  const double share = margin_ == Margin::half_diagonal ? std::sqrt(0.75) : 0.5;
  const double bound = volume().frame_tolerance() - share * volume().grid().spacing;
  if (!(bound > 0)) {
    std::ostringstream text;
    text << "the method paper needs a finer grid: at a precision of " << volume().precision()
         << " its margin is more than the tolerance; take precision=1.1";
    throw InvalidInput(text.str());
  }
  return static_cast<float>(bound);
}

bool Paper::add_triangle_samples(const Corners& corners, std::uint32_t counter,
                                 std::vector<SampledTriangle>& triangles) const {
  const glm::dvec3 along = corners[1] - corners[0], across = corners[2] - corners[0];
  const glm::dvec3 third = across - along;
  const double longest =
      std::sqrt(std::max({glm::dot(along, along), glm::dot(across, across), glm::dot(third, third)}));
  const double l = std::ceil(longest);
  // A comparison with NaN is false, so that NaN fails as well.
  if (!(l + 2 <= largest_)) return false;
  // A candidate that is one point draws nothing, but the division must not be by zero.
  const double steps = std::max(l, 1.0);
  if (l > kCorner) {
    const glm::dvec3 last = glm::dvec3(volume().grid().nodes) - 1.0;
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& p = corners[k];
      const glm::dvec3 beyond = glm::max(-p, p - last);
      if (std::max({beyond.x, beyond.y, beyond.z}) <= kCorner + 1) continue;
      triangles.push_back(
          {p, kCorner, (corners[(k + 1) % 3] - p) / steps, counter, (corners[(k + 2) % 3] - p) / steps, 0});
      return true;
    }
  }
  triangles.push_back({corners[0], static_cast<float>(l), along / steps, counter, across / steps, 0});
  return true;
}

void Paper::use(const gl::Program& program, float bound) const {
  texture_->texture().bind(0);
  program.set("distances", 0);
  program.set("bound", bound);
  program.set("nodes", glm::vec3(volume().grid().nodes));
  program.set("scale", texture_->scale());
  program.set("offset", texture_->offset());
}

const SampledCheck::Programs& Paper::programs() const {
  struct Own : Programs {
    Own() : Programs("paper.frag") {}
  };
  return gl::of_context<Own>();
}

Verdict Paper::verdict(std::uint64_t counted, std::uint64_t) const {
  return counted == 0 ? Verdict::inside : Verdict::outside;
}

}  // namespace tolvol
