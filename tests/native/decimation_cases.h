// SPDX-License-Identifier: GPL-3.0-or-later
/// What tests of decimation share: meshes with matrix, storage and tolerance, and the judge of what became of them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <vector>

#include "decimation/decimation.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "placed_mesh.h"
#include "shapes.h"

namespace tolvol::cases {

using glm::dvec3;
using Options = DecimationOptions;

using Case = PlacedMesh;

inline DecimationResult run(const Case& c, const Options& options = {}) {
  const auto volume = c.volume();
  return decimate(c.mesh.vertices, c.mesh.triangles, c.space(), volume.get(), options);
}

/// Whatever the number of threads.
inline void expect_same_bits(const Case& c, Options options, std::initializer_list<unsigned> threads = {3}) {
  options.threads = 1;
  const DecimationResult one = run(c, options);
  for (const unsigned count : threads) {
    options.threads = count;
    const DecimationResult several = run(c, options);
    EXPECT_EQ(one.vertices, several.vertices);
    EXPECT_EQ(one.triangles, several.triangles);
    EXPECT_EQ(one.triangle_source, several.triangle_source);
    EXPECT_EQ(one.source_weights, several.source_weights);
  }
}

inline void expect_within(const Case& c, const DecimationResult& r, bool two_sided = true) {
  for (const dvec3& p : r.vertices) {
    if (c.storage == Storage::float32) {
      ASSERT_EQ(p, rounded_to_float32(p)) << "judged as stored";
    }
  }
  const TriangleMesh result = c.world(r.vertices, r.triangles), reference = c.world(c.mesh.vertices, c.mesh.triangles);
  const double tolerance = c.tolerance();
  EXPECT_LE(hausdorff(result, reference, {.bound = tolerance, .threads = 1, .narrow = false}).upper, tolerance)
      << "forward";
  if (two_sided) {
    EXPECT_LE(hausdorff(reference, result, {.bound = tolerance, .threads = 1, .narrow = false}).upper, tolerance)
        << "backward";
  }
}

/// Meshes of every kind.
inline std::vector<Case> all() {
  glm::dmat4 mirrored(1), sheared(1), far_away(1), tiny(1e-6), huge(1e6);
  mirrored[0][0] = -1;
  sheared[1][0] = 0.7, sheared[2][1] = -0.4, sheared[0][0] = 3;
  far_away[3] = {5000, -3000, 100, 1};
  tiny[3][3] = huge[3][3] = 1;
  const unsigned side = across(12);
  TriangleMesh fins = shapes::grid(side);  // a second sheet through the middle of the first
  for (unsigned i = 0; i < side; ++i) {
    const unsigned a = i * (side + 1) + side / 2, b = a + side + 1, c = unsigned(fins.vertices.size());
    fins.vertices.push_back(fins.vertices[a] + dvec3(0, 0, 0.2));
    fins.vertices.push_back(fins.vertices[b] + dvec3(0, 0, 0.2));
    fins.triangles.emplace_back(a, b, c), fins.triangles.emplace_back(b, c + 1, c);
  }
  TriangleMesh misoriented = shapes::torus(across(26));
  for (std::size_t i = 0; i < misoriented.triangles.size(); i += 3)
    std::swap(misoriented.triangles[i].y, misoriented.triangles[i].z);
  TriangleMesh duplicates = shapes::box(across(8));
  const auto tenth = static_cast<std::ptrdiff_t>(duplicates.triangles.size() / 10);
  for (std::ptrdiff_t i = 0; i < tenth; ++i) duplicates.triangles.push_back(duplicates.triangles[std::size_t(i)]);
  TriangleMesh slivers = shapes::grid(across(26));  // a plate squeezed to slivers, bent
  for (dvec3& p : slivers.vertices) p = rounded_to_float32(dvec3(p.x, p.y * 1e-3, 0.05 * std::sin(9 * p.x)));
  return {{shapes::torus(across(34), 0.002)},
          {shapes::torus(across(34), 0.02), glm::dmat4(1), Storage::float64},
          {shapes::box(across(10))},
          {shapes::stored(shapes::grid(across(26)))},
          {shapes::soup(shapes::torus(across(24)))},
          {shapes::stored(fins)},
          {misoriented},
          {duplicates},
          {slivers},
          {shapes::torus(across(26)), mirrored},
          {shapes::torus(across(26)), sheared},
          {shapes::torus(across(26)), far_away},
          {shapes::torus(across(26)), tiny},
          {shapes::torus(across(26)), huge},
          {shapes::torus(40, 0.002), glm::dmat4(1), Storage::float32, 0.05},
          {shapes::stored(shapes::joined(shapes::box(across(6)), shapes::grid(across(6)))), glm::dmat4(1),
           Storage::float32, 10}};
}

}  // namespace tolvol::cases
