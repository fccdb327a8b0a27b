// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/canvas.h"

#include <algorithm>
#include <sstream>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "gl/context.h"

namespace tolvol {
namespace {

// A pixel has at most so many samples along each axis: more than 64 in all cannot be told apart in 8 bits.
constexpr int kMostSamples = 8;

/// Averages the samples of a tile into its pixels of the image.
void resolve(const std::vector<std::uint8_t>& drawn, int row, const glm::ivec2& from, const glm::ivec2& count,
             int samples, Image& image) {
  parallel_for(static_cast<std::size_t>(count.y), 64, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      const std::size_t image_row = static_cast<std::size_t>(image.height - 1 - from.y) - y;
      std::uint8_t* out =
          &image.pixels[4 * (image_row * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(from.x))];
      for (int x = 0; x < count.x; ++x, out += 4) {
        unsigned sum[4] = {};
        for (int j = 0; j < samples; ++j) {
          const std::uint8_t* in = &drawn[4 * ((y * static_cast<std::size_t>(samples) + static_cast<std::size_t>(j)) *
                                                   static_cast<std::size_t>(row) +
                                               static_cast<std::size_t>(x * samples))];
          for (int i = 0; i < samples; ++i, in += 4) {
            for (int k = 0; k < 4; ++k) sum[k] += in[k];
          }
        }
        const unsigned all = static_cast<unsigned>(samples * samples);
        for (int k = 0; k < 3 && sum[3] > 0; ++k) {
          out[k] = static_cast<std::uint8_t>(std::min((255 * sum[k] + sum[3] / 2) / sum[3], 255u));
        }
        out[3] = static_cast<std::uint8_t>((sum[3] + all / 2) / all);
      }
    }
  });
}

}  // namespace

void require(const Resolution& r) {
  if (r.samples < 1 || r.samples > kMostSamples) {
    throw InvalidInput("samples must be from 1 to " + std::to_string(kMostSamples) + ", not " +
                       std::to_string(r.samples));
  }
  int largest = 0;
  gl::run([&] { largest = gl::Framebuffer::largest(); });
  const int most = largest / r.samples;
  if (r.size.x < 1 || r.size.y < 1 || r.size.x > most || r.size.y > most) {
    std::ostringstream text;
    text << "the picture's width and height must be from 1 to " << most << " pixels with samples=" << r.samples
         << ", not " << r.size.x << " x " << r.size.y;
    throw InvalidInput(text.str());
  }
}

gl::Texture transfer_texture(Transfer transfer) {
  const std::vector<glm::u8vec3> colours = transfer_colours(transfer, kTransferColours);
  gl::Texture texture(GL_TEXTURE_1D, GL_RGB8, {kTransferColours, 1, 1}, GL_RGB, GL_UNSIGNED_BYTE, colours.data());
  texture.filter_linearly();
  return texture;
}

Image Canvas::draw(const Resolution& r, int tile, const std::function<void(const glm::vec2&)>& draw,
                   Progress* progress) {
  require(r);
  const int pixels = std::max(1, tile / r.samples);  // This is the side of a tile.
  const glm::ivec2 side = glm::min(glm::ivec2(pixels), r.size), tiles = (r.size + side - 1) / side;
  Image image{r.size.x, r.size.y,
              std::vector<std::uint8_t>(std::size_t{4} * static_cast<std::size_t>(r.size.x) *
                                        static_cast<std::size_t>(r.size.y))};
  const Call call(progress);
  if (progress) progress->begin("picture");
  for (int i = 0; i < tiles.x * tiles.y; ++i) {
    poll();
    if (progress) progress->update(static_cast<double>(i) / (tiles.x * tiles.y));
    const glm::ivec2 from = glm::ivec2(i % tiles.x, i / tiles.x) * side, count = glm::min(side, r.size - from);
    std::vector<std::uint8_t> drawn;
    gl::run([&, asked = Call::current()] {
      const Call::Within within(asked);  // the thread that draws polls for this call
      if (tile_ != side * r.samples) {
        tile_ = glm::ivec2(0);
        framebuffer_ = gl::Framebuffer::with_colour(side.x * r.samples, side.y * r.samples);
        tile_ = side * r.samples;
      }
      framebuffer_.bind();
      const glm::ivec2 first = from * r.samples;
      glViewport(-first.x, -first.y, r.size.x * r.samples, r.size.y * r.samples);
      // A tile that was cancelled may have left any of these set.
      glDisable(GL_BLEND);
      glDisable(GL_POLYGON_OFFSET_LINE);
      glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
      glDepthMask(GL_TRUE);
      glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
      glClearColor(0, 0, 0, 0);
      glClearDepth(1);
      glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
      draw(glm::vec2(first));
      drawn = framebuffer_.read_pixels();
    });
    resolve(drawn, side.x * r.samples, from, count, r.samples, image);
  }
  return image;
}

}  // namespace tolvol
