// SPDX-License-Identifier: GPL-3.0-or-later
/// What the tests of constrain() share: scenes with wishes, and the judges. What is stored is judged by
/// measure/hausdorff.h and once more by the certificate, whole.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "check/certificate.h"
#include "measure/hausdorff.h"
#include "motion/constrain.h"
#include "placed_mesh.h"
#include "shapes.h"

namespace tolvol::wishes {

using glm::dvec3;
using Points = std::vector<dvec3>;

struct Scene : PlacedMesh {
  dvec3 stored(const dvec3& p) const { return storage == Storage::float32 ? rounded_to_float32(p) : p; }
  /// Every vertex moved by `motion(v)`, a world vector in tolerances.
  template <class Motion>
  Points wish(Motion&& motion) const {
    const glm::dmat3 back = glm::inverse(glm::dmat3(to_world));
    Points result;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
      result.push_back(stored(mesh.vertices[v] + back * (tolerance() * dvec3(motion(v)))));
    return result;
  }
};

inline ConstrainResult run(const Scene& scene, const ToleranceVolume& volume, const Points& wish,
                           const ConstrainOptions& options) {
  return constrain(scene.mesh.vertices, wish, shapes::indices(scene.mesh), 3, scene.space(), volume, options);
}

inline ConstrainResult run(const Scene& scene, const Points& wish, const ConstrainOptions& options = {}) {
  return run(scene, *scene.volume(), wish, options);
}

/// Noise of a standard deviation of so many tolerances along each axis.
inline auto noise(double deviation, unsigned seed = 1) {
  return [deviation, engine = std::mt19937(seed), normal = std::normal_distribution<double>()](std::size_t) mutable {
    const double x = normal(engine), y = normal(engine), z = normal(engine);
    return deviation * dvec3(x, y, z);
  };
}

inline std::vector<Verdict> verdicts(const ToleranceVolume& volume, const StoredSpace& space, const Points& points,
                                     const std::vector<std::uint32_t>& faces, int corners = 3) {
  return Certificate(volume).check({points, space, faces, corners}, {1, nullptr});
}

inline bool all_inside(const std::vector<Verdict>& verdicts) {
  return std::all_of(verdicts.begin(), verdicts.end(), [](Verdict v) { return v == Verdict::inside; });
}

inline void expect_inside(const Scene& scene, const ToleranceVolume& volume, const ConstrainResult& r, bool two_sided) {
  const auto world = [&](Points points) {
    for (dvec3& p : points) p = scene.space().world(p);
    return TriangleMesh{points, scene.mesh.triangles};
  };
  const double tolerance = scene.tolerance();
  const TriangleMesh after = world(r.vertices), before = world(scene.mesh.vertices);
  const auto distance = [&](const TriangleMesh& a, const TriangleMesh& b) {
    return hausdorff(a, b, {.bound = tolerance, .threads = 1, .narrow = false}).upper;
  };
  EXPECT_LE(distance(after, before), tolerance);
  if (two_sided) {
    EXPECT_LE(distance(before, after), tolerance);
  }
  EXPECT_TRUE(all_inside(verdicts(volume, scene.space(), r.vertices, shapes::indices(scene.mesh))));
}

inline void expect_inside(const Scene& scene, const ConstrainResult& r, bool two_sided) {
  expect_inside(scene, *scene.volume(), r, two_sided);
}

}  // namespace tolvol::wishes
