// SPDX-License-Identifier: GPL-3.0-or-later
/// Where pictures are drawn: offscreen, tile by tile, with several samples a pixel.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "base/progress.h"
#include "gl/objects.h"
#include "picture/transfer.h"

namespace tolvol {

/// RGBA, 8 bits each, top row first; colours are not multiplied by alpha.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// How large, and how smooth: `samples` times `samples` a pixel.
struct Resolution {
  glm::ivec2 size{1024};
  int samples = 2;
};

/// Throws InvalidInput, naming the limit, for a size that GL cannot draw. Not on the GL thread.
void require(const Resolution& resolution);

/// The table to look distances up in after they were interpolated. On the GL thread.
gl::Texture transfer_texture(Transfer transfer);

class Canvas {
 public:
  /// Calls draw(first) on the GL thread for each tile, its framebuffer bound, transparent and at its farthest depth;
  /// gl_FragCoord.xy + first counts samples from the lower left of the picture. `draw` writes colours multiplied by
  /// alpha. Between tiles progress is shown and a wish to stop is heeded. Throws like require().
  Image draw(const Resolution& resolution, int tile, const std::function<void(const glm::vec2& first)>& draw,
             Progress* progress);

 private:
  gl::Framebuffer framebuffer_;
  glm::ivec2 tile_{0};
};

}  // namespace tolvol
