// SPDX-License-Identifier: GPL-3.0-or-later
// Each ray ends on the mesh or on a backdrop, so that neither order nor depth textures matter. The mesh's depth is
// drawn first, then the rays to its visible parts, then the rays that miss it.
#include "picture/render_volume.h"

#include <algorithm>

#include "base/errors.h"
#include "base/parallel.h"
#include "geometry/lengths.h"
#include "gl/context.h"

namespace tolvol {
namespace {

// A tile has so many samples along each axis. A call can be cancelled between tiles.
constexpr int kVolumeTile = 256;
// The field far from the surface has this many nodes along the longest side of its box: more nodes cost more time to
// fill than they save in steps.
constexpr int kFarNodes = 40;

glm::vec4 plane_in_nodes(const VolumeRenderer::Cut& cut, const Frame& frame, const PictureField& field) {
  const glm::dvec3 normal = cut.normal / largest(cut.normal);
  // NaN fails as well.
  if (!(glm::length(normal) >= 1) || !(glm::length(cut.point) < std::numeric_limits<double>::infinity())) {
    throw InvalidInput("the cut's point and normal must be finite and its normal not zero");
  }
  const glm::dvec3 unit = glm::normalize(normal), point = (frame.from_world(cut.point) - field.origin());
  return glm::vec4(unit, -glm::dot(unit, point) / field.spacing());
}

}  // namespace

VolumeRenderer::VolumeRenderer(const PictureField& field, const Hierarchy& hierarchy, unsigned threads)
    : field_(&field) {
  const glm::dvec3 extent = glm::dvec3(field.nodes() - 1);
  far_spacing_ = std::max({extent.x, extent.y, extent.z}) / (kFarNodes - 1);
  const glm::ivec3 size = glm::ivec3(glm::ceil(extent / far_spacing_)) + 1;
  std::vector<float> distances(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
                               static_cast<std::size_t>(size.z));
  parallel_for(distances.size(), 64, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const int j = static_cast<int>(i);
      const glm::dvec3 node = glm::dvec3(j % size.x, j / size.x % size.y, j / (size.x * size.y)) * far_spacing_;
      distances[i] =
          static_cast<float>(hierarchy.nearest(field.origin() + field.spacing() * node).distance / field.spacing());
    }
  });
  gl::run([&] {
    far_ = gl::Texture(GL_TEXTURE_3D, GL_R32F, size, GL_RED, GL_FLOAT, distances.data());
    far_.filter_linearly();
    transfer_ = transfer_texture(Transfer::signed_distance);
    no_vertices_ = gl::VertexArray::make();
    const gl::Program::Stage rays{GL_FRAGMENT_SHADER,
                                  {"signed_distance.glsl", "distance_colour.glsl", "march.glsl", "render_volume.frag"}};
    depth_ = gl::Program({{GL_VERTEX_SHADER, {"mesh.vert"}}, {GL_FRAGMENT_SHADER, {"edge.frag"}}});
    surface_ = gl::Program({{GL_VERTEX_SHADER, {"mesh.vert"}}, rays});
    backdrop_ = gl::Program({{GL_VERTEX_SHADER, {"backdrop.vert"}}, rays});
  });
}

Image VolumeRenderer::render(const DrawnMesh& mesh, const Camera& camera, const Frame& frame, const Options& options) {
  validate(camera);
  const Resolution& r = options.resolution;
  const View view(camera, frame, static_cast<double>(r.size.x) / r.size.y, mesh.box);
  const glm::mat4 to_clip(view.to_clip * field_->to_frame());
  const glm::vec3 eye = field_->node(view.eye);
  const glm::vec4 cut = options.cut ? plane_in_nodes(*options.cut, frame, *field_) : glm::vec4(0);
  bool written = false;
  const auto set_rays = [&](gl::Program& program, bool surface) {
    program.use();
    program.set("far_spacing", static_cast<float>(far_spacing_));
    program.set("tolerance", static_cast<float>(field_->precision()));
    program.set("eye", eye);
    program.set("cut", cut);
    program.set("surface", surface ? 1 : 0);
  };
  return canvas_.draw(
      r, kVolumeTile,
      [&](const glm::vec2&) {
        if (!std::exchange(written, true)) mesh_.write(mesh);
        field_->texture().bind(0);
        transfer_.bind(1);
        far_.bind(2);
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_LESS);
        glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        depth_.use();
        depth_.set("to_clip", to_clip);
        mesh_.draw();
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        glDepthFunc(GL_LEQUAL);
        glDepthMask(GL_FALSE);
        set_rays(surface_, true);
        surface_.set("to_clip", to_clip);
        mesh_.draw();
        set_rays(backdrop_, false);
        backdrop_.set("forward", glm::vec3(view.forward));
        backdrop_.set("right", glm::vec3(view.right));
        backdrop_.set("above", glm::vec3(view.above));
        // This is beyond the box wherever the eye is.
        const glm::vec3 nodes(field_->nodes());
        backdrop_.set("end", glm::length(eye - nodes / 2.0f) + glm::length(nodes));
        no_vertices_.bind();
        glDrawArrays(GL_TRIANGLES, 0, 3);
      },
      options.progress);
}

}  // namespace tolvol
