// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/tolerance_volume.h"

#include <cmath>
#include <sstream>

#include "base/call.h"
#include "base/errors.h"
#include "field/fast_marching.h"
#include "field/scatter.h"
#ifdef TOLVOL_GL
#include "field/scatter_gl.h"
#endif
#include "field/signs.h"

namespace tolvol {
namespace {

std::vector<glm::dvec3> used_only(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles) {
  const std::vector<bool> used = used_vertices(vertices.size(), triangles);
  std::vector<glm::dvec3> result;
  result.reserve(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (used[i]) result.push_back(vertices[i]);
  }
  return result;
}

/// Calls use() with the reference, its faces turned as they are in the world.
template <class Use>
auto in_the_world(const TriangleMesh& reference, bool mirrored, Use&& use) {
  if (!mirrored) return use(reference);
  TriangleMesh turned = reference;
  for (glm::uvec3& t : turned.triangles) std::swap(t.y, t.z);
  return use(turned);
}

}  // namespace

ToleranceVolume::ToleranceVolume(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                                 const StoredSpace& space, double tolerance, const Options& options)
    : tolerance_(tolerance), field_(options.field), mirrored_(space.mirrors()) {
  const Call call(options.progress);
  validate(vertices, triangles);
  diagonal_ = longest_diagonal(vertices, triangles, space.to_world());
  if (!(tolerance > 0) || !std::isfinite(tolerance)) {
    throw InvalidInput("the tolerance must be a positive length");
  }
  if (tolerance > diagonal_) {
    std::ostringstream text;
    text << "the tolerance " << tolerance << " is larger than the reference, whose size is " << diagonal_;
    throw InvalidInput(text.str(), "tolerance_too_large");
  }
  const std::vector<glm::dvec3> used = used_only(vertices, triangles);
  Box world;
  for (const glm::dvec3& p : used) world.add(space.world(p));
  frame_ = Frame(world);
  const StoredSpace placed = space.in(frame_);
  mapping_error_ = placed.mapping_error(used);
  provable(0);  // this throws before any work if double precision cannot hold the tolerance
  reference_.vertices = placed.frame(vertices);
  reference_.triangles.assign(triangles.begin(), triangles.end());

  Box box;
  for (const glm::dvec3& p : used) box.add(placed.frame(p));
  // What is proved of a frame holds for coordinates of about 1. They are larger only where the frame itself was
  // rounded.
  constexpr double kAboutOne = 1.1;
  const glm::dvec3 reach = glm::max(-box.lower, box.upper);
  if (!(std::max({reach.x, reach.y, reach.z}) <= kAboutOne)) refuse_tolerance();
  grid_ = layout_grid(box, frame_tolerance(), options.precision, options.grid_memory);
  fill_grid(options);
  hierarchy_.emplace(reference_, options.threads);
}

void ToleranceVolume::fill_grid(const Options& options) {
  switch (field_) {
    case Field::scatter:
      return scatter(reference_, grid_, options.threads, options.progress);
    case Field::gl:
#ifdef TOLVOL_GL
      return scatter_gl(reference_, grid_, options.progress);
#else
      throw GlUnavailable::not_built();
#endif
    case Field::fast_marching:
      in_the_world(reference_, mirrored_, [&](const TriangleMesh& mesh) {
        fast_marching(mesh, grid_, frame_tolerance(), options.threads, options.progress);
      });
  }
}

std::vector<float> ToleranceVolume::signed_distance() const {
  return in_the_world(reference_, mirrored_,
                      [&](const TriangleMesh& mesh) { return tolvol::signed_distance(mesh, grid_); });
}

std::size_t ToleranceVolume::memory() const {
  constexpr std::size_t kHierarchy = 150;  // the hierarchy has this many bytes for each triangle (hierarchy.h)
  return reference_.vertices.size() * sizeof(glm::dvec3) +
         reference_.triangles.size() * (sizeof(glm::uvec3) + kHierarchy) + grid_.memory();
}

double ToleranceVolume::provable(double mapping_error) const {
  const double epsilon = frame_tolerance();
  const double left = epsilon - mapping_error_ - mapping_error -
                      witness_error(1 + 2 * epsilon);  // faces of the result, too, serve as witnesses
  if (!(left > 0.5 * epsilon)) refuse_tolerance();
  return left;
}

void ToleranceVolume::refuse_tolerance() const {
  std::ostringstream text;
  text << "the tolerance " << tolerance_ << " is too small for double precision at these coordinates; "
       << "move the mesh nearer to the origin or take a larger tolerance";
  throw InvalidInput(text.str(), "tolerance_too_small");
}

}  // namespace tolvol
