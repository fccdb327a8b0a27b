// SPDX-License-Identifier: GPL-3.0-or-later
/// Draws pictures offscreen, tile by tile, with several samples for each pixel.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "base/progress.h"
#include "gl/objects.h"
#include "picture/transfer.h"

namespace tolvol {

/// An image in RGBA with 8 bits each, top row first. Colours are not multiplied by alpha.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

/// The size of a picture, and its smoothness: a pixel has `samples` times `samples` samples.
struct Resolution {
  glm::ivec2 size{1024};
  int samples = 2;
};

/// Throws InvalidInput, naming the limit, for a size that GL cannot draw. Must not be called on the GL thread.
void require(const Resolution& resolution);

/// Returns the table that maps interpolated distances to colours. Must be called on the GL thread.
gl::Texture transfer_texture(Transfer transfer);

class Canvas {
 public:
  /// Calls draw(first) on the GL thread for each tile. The framebuffer of the tile is bound, transparent and at its
  /// farthest depth, and gl_FragCoord.xy + first counts samples from the lower left of the picture. `draw` writes
  /// colours multiplied by alpha. Between tiles it shows progress and polls. Throws like require().
  Image draw(const Resolution& resolution, int tile, const std::function<void(const glm::vec2& first)>& draw,
             Progress* progress);

 private:
  gl::Framebuffer framebuffer_;
  glm::ivec2 tile_{0};
};

}  // namespace tolvol
