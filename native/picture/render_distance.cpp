// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/render_distance.h"

#include "gl/context.h"

namespace tolvol {
namespace {

// A tile has so many samples along each axis. A call can be cancelled between tiles.
constexpr int kDistanceTile = 1024;
// Stripes follow one another at this distance, in pixels.
constexpr float kStripe = 12;

}  // namespace

DistanceRenderer::DistanceRenderer(const PictureField& field) : field_(&field) {
  gl::run([&] {
    faces_ =
        gl::Program({{GL_VERTEX_SHADER, {"mesh.vert"}},
                     {GL_FRAGMENT_SHADER, {"signed_distance.glsl", "distance_colour.glsl", "render_distance.frag"}}});
    edges_ = gl::Program({{GL_VERTEX_SHADER, {"mesh.vert"}}, {GL_FRAGMENT_SHADER, {"edge.frag"}}});
    signed_ = transfer_texture(Transfer::signed_distance);
    magnitude_ = transfer_texture(Transfer::magnitude);
  });
}

Image DistanceRenderer::render(const DrawnMesh& mesh, const Camera& camera, const Frame& frame,
                               const Options& options) {
  validate(camera);
  const Resolution& r = options.resolution;
  const View view(camera, frame, static_cast<double>(r.size.x) / r.size.y, mesh.box);
  const glm::mat4 to_clip(view.to_clip * field_->to_frame());
  bool written = false;
  return canvas_.draw(
      r, kDistanceTile,
      [&](const glm::vec2& first) {
        if (!std::exchange(written, true)) mesh_.write(mesh);
        field_->texture().bind(0);
        const bool is_signed = options.transfer == Transfer::signed_distance;
        (is_signed ? signed_ : magnitude_).bind(1);
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_LESS);
        faces_.use();
        faces_.set("to_clip", to_clip);
        faces_.set("tolerance", static_cast<float>(field_->precision()));
        faces_.set("lowest", is_signed ? -1.0f : 0.0f);
        faces_.set("eye", field_->node(view.eye));
        faces_.set("first", first);
        faces_.set("period", kStripe * static_cast<float>(r.samples));
        faces_.set("outside", glm::vec3(kOutsideColour) / 255.0f);
        faces_.set("stripe", glm::vec3(kOutsideStripe) / 255.0f);
        mesh_.draw();
        if (!options.edges) return;
        edges_.use();
        edges_.set("to_clip", to_clip);
        glEnable(GL_BLEND);
        glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
        glEnable(GL_POLYGON_OFFSET_LINE);
        glPolygonOffset(-1, -1);
        glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
        mesh_.draw();
        glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
        glDisable(GL_POLYGON_OFFSET_LINE);
        glDisable(GL_BLEND);
      },
      options.progress);
}

}  // namespace tolvol
