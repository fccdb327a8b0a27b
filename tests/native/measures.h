// SPDX-License-Identifier: GPL-3.0-or-later
/// What the tests of hausdorff() share: meshes, and what must hold of every answer.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/closest_point.h"
#include "measure/hausdorff.h"
#include "shapes.h"

namespace tolvol::measures {

using glm::dvec3;

/// Longitude and latitude.
inline TriangleMesh sphere(unsigned n, double radius) {
  return shapes::squares(n, [&](const dvec3& p) {
    const double longitude = 2 * M_PI * p.x, latitude = M_PI * p.y;
    return radius * dvec3(std::sin(latitude) * std::cos(longitude), std::sin(latitude) * std::sin(longitude),
                          std::cos(latitude));
  });
}

inline TriangleMesh subdivided(const TriangleMesh& mesh) {
  TriangleMesh fine;
  for (const glm::uvec3& t : mesh.triangles) {
    const dvec3 &a = mesh.vertices[t.x], &b = mesh.vertices[t.y], &c = mesh.vertices[t.z];
    const auto n = unsigned(fine.vertices.size());
    for (const dvec3& p : {a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0}) fine.vertices.push_back(p);
    for (const glm::uvec3& s : {glm::uvec3(0, 3, 5), {3, 1, 4}, {5, 4, 2}, {3, 4, 5}})
      fine.triangles.push_back(s + glm::uvec3(n));
  }
  return fine;
}

inline double brute(const dvec3& p, const TriangleMesh& mesh) {
  double squared = std::numeric_limits<double>::infinity();
  for (const glm::uvec3& t : mesh.triangles) {
    squared = std::min(squared,
                       closest_point(p, mesh.vertices[t.x], mesh.vertices[t.y], mesh.vertices[t.z]).distance_squared);
  }
  return std::sqrt(squared);
}

/// What must hold of every answer: the interval in order, narrow unless `narrow` says otherwise, its witness on the
/// triangle it names and as far away as it says.
inline HausdorffInterval measured(const TriangleMesh& a, const TriangleMesh& b, const HausdorffOptions& options = {},
                                  double size = 1, bool narrow = true) {
  const HausdorffInterval h = hausdorff(a, b, options);
  EXPECT_LE(0, h.lower);
  EXPECT_LE(h.lower, h.upper);
  if (narrow) {
    EXPECT_LE(h.upper - h.lower, std::max(0.001 * h.upper, 1e-13 * size));
  }
  const glm::uvec3& t = a.triangles.at(h.triangle);
  const double off =
      std::sqrt(closest_point(h.position, a.vertices[t.x], a.vertices[t.y], a.vertices[t.z]).distance_squared);
  EXPECT_LE(off, 1e-14 * size);
  EXPECT_NEAR(brute(h.position, b), h.lower, 2e-14 * size + 1e-9 * h.lower);
  return h;
}

}  // namespace tolvol::measures
