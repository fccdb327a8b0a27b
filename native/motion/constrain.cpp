// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/constrain.h"

#include "base/call.h"
#include "base/errors.h"
#include "check/certificate.h"
#include "check/input_checks.h"

namespace tolvol {

ConstrainResult constrain(std::span<const glm::dvec3> before, std::span<const glm::dvec3> after,
                          std::span<const std::uint32_t> faces, int corners, const StoredSpace& space,
                          const ToleranceVolume& volume, const ConstrainOptions& options) {
  if (before.size() != after.size()) {
    throw InvalidInput("before has " + std::to_string(before.size()) + " vertices and after " +
                       std::to_string(after.size()) + "; both must be the same ones");
  }
  require_normal_angle(options.max_normal_angle);
  const Call call(options.progress);
  PullBack pull_back(volume, space, faces, corners, before.size(), options.threads);
  PullBack::Start start = pull_back.start(
      before, {options.outside, options.two_sided, options.crossings, options.max_normal_angle}, options.progress);
  ConstrainResult result;
  result.outside = FaceCount::of(start.outside);
  result.uncovered = start.uncovered;
  result.warnings = std::move(start.warnings);
  const Certificate certificate(volume);
  result.method = certificate.method(), result.renderer = certificate.renderer();

  std::vector<std::uint32_t> moved;
  std::vector<glm::dvec3> from, to;
  for (std::uint32_t v = 0; v < before.size(); ++v) {
    if (before[v] == after[v]) continue;
    moved.push_back(v), from.push_back(before[v]), to.push_back(after[v]);
  }
  if (options.progress) options.progress->begin("pulling back");
  const PullBack::Moving moving = pull_back.moving(std::move(moved));
  const PullBack::Result ends = pull_back.move(moving, from, to, options.mode, options.progress);
  result.vertices.assign(after.begin(), after.end());
  result.factors.assign(before.size(), 1);
  result.normals = pull_back.normals();
  result.held_back = ends.held_back, result.kept_from_crossing = ends.kept_from_crossing;
  for (std::size_t i = 0; i < moving.vertices.size(); ++i) {
    result.vertices[moving.vertices[i]] = ends.reached[i];
    result.factors[moving.vertices[i]] = ends.factors[i];
  }
  return result;
}

}  // namespace tolvol
