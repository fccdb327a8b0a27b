// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "distance_judge.h"
#include "measure/hausdorff.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// A height field over n x n squares with random heights: rough, so that the largest distance can be anywhere.
TriangleMesh terrain(unsigned n, unsigned seed, double roughness) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-roughness, roughness);
  return shapes::squares(n, [&](const dvec3& p) {
    return dvec3(p.x, p.y, 0.1 * std::sin(6 * p.x) * std::cos(5 * p.y) + uniform(random));
  });
}

TEST(HausdorffCgal, AgreesWithinItsError) {
  const double error = 1e-7;
  for (const auto& [n, m, roughness] :
       {std::tuple{4u, 60u, 0.02}, {60u, 4u, 0.02}, {13u, 17u, 0.1}, {50u, 50u, 0.01}}) {
    const TriangleMesh a = terrain(n, 1, roughness), b = terrain(m, 2, roughness);
    const double judged = distance_by_cgal(a, b, error);
    const HausdorffInterval h = hausdorff(a, b);
    EXPECT_LE(h.lower, judged + error);
    EXPECT_GE(h.upper, judged - error);
  }
}

}  // namespace
