// SPDX-License-Identifier: GPL-3.0-or-later
#include "picture/camera.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "base/errors.h"
#include "geometry/lengths.h"

namespace tolvol {
namespace {

constexpr double kMargin = 1.04;     // the picture is this many times larger than the framed mesh
constexpr double kNearest = 1.0e-4;  // the near plane's distance over the far plane's, for a 32-bit depth buffer

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// The directions right, above and forward of a view, all of unit length.
struct Axes {
  glm::dvec3 right, above, forward;

  Axes(const glm::dvec3& along, const glm::dvec3& up) : forward(unit(along)) {
    right = glm::normalize(glm::cross(forward, unit(up)));
    above = glm::cross(right, forward);
  }
};

void require_direction(const glm::dvec3& along, const glm::dvec3& up) {
  // NaN, which a zero vector gives, fails as well.
  if (!(glm::length(glm::cross(unit(along), unit(up))) > 1e-6)) {
    throw InvalidInput("the camera's up direction must not be zero nor along its view");
  }
}

void require_angle(double angle) {
  if (!(angle > 0 && angle < 180)) throw InvalidInput("the camera's angle must be between 0 and 180 degrees");
}

}  // namespace

void validate(const Camera& camera) {
  if (!finite(camera.eye) || !finite(camera.target) || !finite(camera.up)) {
    throw InvalidInput("the camera's eye, target and up must be finite");
  }
  if (camera.eye == camera.target) throw InvalidInput("the camera's eye and target must not be the same point");
  require_direction(camera.target - camera.eye, camera.up);
  require_angle(camera.angle);
}

Camera framing(std::span<const glm::dvec3> world, std::span<const glm::uvec3> triangles, const Framing& how) {
  if (!finite(how.direction) || !finite(how.up)) throw InvalidInput("the camera's direction and up must be finite");
  require_direction(how.direction, how.up);
  require_angle(how.angle);
  if (!(how.aspect > 0 && std::isfinite(how.aspect))) {
    throw InvalidInput("the picture's width and height must be positive");
  }
  if (!(how.margin >= 0 && std::isfinite(how.margin)))
    throw InvalidInput("the margin around the mesh must not be negative");
  const Axes axes(-how.direction, how.up);
  const glm::dmat3 to_view = glm::transpose(glm::dmat3(axes.right, axes.above, axes.forward));
  const std::vector<bool> used = used_vertices(world.size(), triangles);
  Box box;  // is in the axes of the view
  for (std::size_t i = 0; i < world.size(); ++i) {
    if (used[i]) box.add(to_view * world[i]);
  }
  const glm::dvec3 centre = 0.5 * box.lower + 0.5 * box.upper;
  const double above = std::tan(glm::radians(how.angle) / 2) / kMargin, right = above * how.aspect;
  double distance = 0;
  for (std::size_t i = 0; i < world.size(); ++i) {
    if (!used[i]) continue;
    const glm::dvec3 p = to_view * world[i] - centre;
    const double z = p.z - how.margin;
    distance = std::max({distance, (std::abs(p.x) + how.margin) / right - z, (std::abs(p.y) + how.margin) / above - z});
  }
  // Without this the eye would lie within a flat mesh that is seen edge on.
  const glm::dvec3 extent = box.upper - box.lower;
  distance = std::max({distance, extent.x, extent.y, extent.z});
  if (!(distance > 0)) distance = 1;
  const glm::dvec3 target = glm::transpose(to_view) * centre;
  const Camera camera{target - distance * axes.forward, target, how.up, how.angle};
  validate(camera);
  return camera;
}

View::View(const Camera& camera, const Frame& frame, double aspect, const Box& box)
    : eye(frame.from_world(camera.eye)) {
  const Axes axes(camera.target - camera.eye, camera.up);
  const double half = std::tan(glm::radians(camera.angle) / 2);
  forward = axes.forward, right = axes.right * half * aspect, above = axes.above * half;
  double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p(corner & 1 ? box.upper.x : box.lower.x, corner & 2 ? box.upper.y : box.lower.y,
                       corner & 4 ? box.upper.z : box.lower.z);
    const double z = glm::dot(p - eye, forward);
    nearest = std::min(nearest, z), farthest = std::max(farthest, z);
  }
  if (!(farthest > 0)) farthest = 1;  // the box is behind the eye, so that any planes will do
  farthest *= 1.001;
  nearest = std::max(0.999 * nearest, kNearest * farthest);
  to_clip = glm::perspective(glm::radians(camera.angle), aspect, nearest, farthest) *
            glm::lookAt(eye, eye + forward, axes.above);
}

}  // namespace tolvol
