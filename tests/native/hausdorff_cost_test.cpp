// SPDX-License-Identifier: GPL-3.0-or-later
/// What the search for the largest distance costs where very many triangles share a corner.
#include <gtest/gtest.h>

#include <cmath>

#include "measure/hausdorff.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;

/// A star of needles around one corner, each with a corner near that one. `apart` gives each triangle corners of its
/// own.
TriangleMesh star(unsigned n, bool apart) {
  TriangleMesh mesh;
  for (unsigned i = 0; i < n; ++i) {
    const double angle = 2 * M_PI * i / n;
    mesh.vertices.push_back((i % 2 ? 0.05 : 1.0) * glm::dvec3(std::cos(angle), std::sin(angle), 0));
  }
  mesh.vertices.emplace_back(0, 0, 0);
  for (unsigned i = 0; i < n; ++i) mesh.triangles.emplace_back(n, i, (i + 1) % n);
  return apart ? shapes::soup(mesh) : mesh;
}

// The corner that all share is the farthest from the other star, all triangles of which are about as near to it. To
// look for the nearest again for each triangle of the first would take the square of their number.
TEST(HausdorffCost, ACornerOfManyTrianglesIsLookedAtOnce) {
  const unsigned n = 20000;
  shapes::Random random(41);
  TriangleMesh other = star(n, false);
  for (glm::dvec3& p : other.vertices) p += 0.005 * random.point();
  other.vertices.back() += glm::dvec3(0, 0, 0.03);
  // The search ends after the first pass: the distance is more than the bound.
  for (const bool apart : {false, true}) {
    const TriangleMesh mesh = star(n, apart);
    const std::size_t polls = polls_of([&] { hausdorff(mesh, other, {.bound = 1e-9, .threads = 1}); });
    EXPECT_LT(polls, 10000u) << apart;
  }
}

}  // namespace
