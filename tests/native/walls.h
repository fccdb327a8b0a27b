// SPDX-License-Identifier: GPL-3.0-or-later
/// What the tests of moved meshes that must not cross themselves share: the meshes, their motions, and what crosses.
#pragma once

#include <algorithm>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "measure/hausdorff.h"
#include "motion/constrain.h"
#include "shapes.h"
#include "topology/crossings.h"

namespace tolvol::walls {

using glm::dvec3;
using shapes::flat, shapes::indices;
using Crossed = PullBack::Crossings;

inline const StoredSpace kSingle(glm::dmat4(1), Storage::float32);
using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

inline Pairs pairs_of(std::span<const dvec3> vertices, std::span<const glm::uvec3> triangles) {
  Team alone(1);
  Pairs pairs;
  for (const glm::uvec2& p : crossings(vertices, triangles, 1'000'000, alone, nullptr).pairs) pairs.insert({p.x, p.y});
  return pairs;
}
inline Pairs pairs_of(const TriangleMesh& mesh) { return pairs_of(mesh.vertices, mesh.triangles); }

inline bool none_new(const Pairs& now, const Pairs& before) { return std::ranges::includes(before, now); }

/// Two plates above each other, 0.1 apart.
inline TriangleMesh sandwich(unsigned n = 8, double gap = 0.1) {
  TriangleMesh upper = shapes::grid(n);
  for (dvec3& p : upper.vertices) p.z = gap;
  return shapes::stored(shapes::joined(shapes::grid(n), upper));
}

/// A sphere within a sphere.
inline TriangleMesh hollow(unsigned n, double wall) {
  return shapes::stored(shapes::joined(shapes::sphere(n), shapes::turned(shapes::sphere(n, 1 - wall))));
}

/// A motion of a mesh over its own reference.
struct Motion {
  Motion(TriangleMesh m, double tolerance)
      : mesh(std::move(m)), tolerance(tolerance), volume(mesh.vertices, mesh.triangles, kSingle, tolerance) {}

  ConstrainResult run(const std::vector<dvec3>& wish, const ConstrainOptions& options = {}) const {
    return constrain(mesh.vertices, wish, indices(mesh), 3, kSingle, volume, options);
  }
  /// Each vertex goes by place(position) - position.
  template <class Place>
  std::vector<dvec3> wish(Place&& place) const {
    std::vector<dvec3> result;
    for (const dvec3& p : mesh.vertices) result.push_back(rounded_to_float32(place(p)));
    return result;
  }
  std::vector<dvec3> noise(double amount, unsigned seed) const {
    shapes::Random random(seed);
    return wish([&](const dvec3& p) { return p + amount * random.point(); });
  }
  double deviation(const std::vector<dvec3>& vertices) const {
    const TriangleMesh now{vertices, mesh.triangles};
    return std::max(hausdorff(now, mesh, {tolerance, 1, nullptr}).upper,
                    hausdorff(mesh, now, {tolerance, 1, nullptr}).upper);
  }

  TriangleMesh mesh;
  double tolerance;
  ToleranceVolume volume;
};

}  // namespace tolvol::walls
