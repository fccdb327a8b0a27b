// SPDX-License-Identifier: GPL-3.0-or-later
#include "field/fast_marching.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/errors.h"
#include "base/simd.h"
#include "field/scatter.h"
#include "field/signs.h"
#include "laid_out.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

DistanceGrid marched(const TriangleMesh& mesh, double tolerance, double precision, unsigned threads = 1) {
  DistanceGrid grid = laid_out(mesh, tolerance, precision);
  fast_marching(mesh, grid, tolerance, threads);
  return grid;
}

/// Exact: scatter and its signs.
DistanceGrid exact(const TriangleMesh& mesh, double tolerance, double precision) {
  DistanceGrid grid = laid_out(mesh, tolerance, precision);
  scatter(mesh, grid, 1);
  grid.distance = signed_distance(mesh, grid, 1);
  grid.is_signed = true;
  return grid;
}

/// Calls visit(index, position) for every node.
template <class Visit>
void for_nodes(const DistanceGrid& g, Visit&& visit) {
  for (int z = 0; z < g.nodes.z; ++z) {
    for (int y = 0; y < g.nodes.y; ++y) {
      for (int x = 0; x < g.nodes.x; ++x) visit(g.index(x, y, z), g.origin + g.spacing * dvec3(x, y, z));
    }
  }
}

/// The largest error in spacings among the nodes within `reach`, and the share of them with the wrong sign.
struct Judged {
  double error = 0, wrong_sign = 0;
};
Judged judge(const DistanceGrid& grid, const DistanceGrid& truth, double reach) {
  Judged r;
  int count = 0, wrong = 0;
  for_nodes(grid, [&](std::size_t i, const dvec3&) {
    if (std::abs(truth.distance[i]) > reach) return;
    ++count;
    wrong += std::signbit(grid.distance[i]) != std::signbit(truth.distance[i]);
    r.error =
        std::max(r.error, std::abs(double(std::abs(grid.distance[i])) - std::abs(truth.distance[i])) / grid.spacing);
  });
  EXPECT_GT(count, 100);
  r.wrong_sign = wrong / double(count);
  return r;
}

/// A plane with a given normal through the origin, wide enough to have no boundary within reach of `radius`.
TriangleMesh tilted_plate(const dvec3& normal, double half, unsigned n = 4) {
  const dvec3 u = glm::normalize(glm::cross(normal, dvec3(0.3, 0.5, -0.8))), v = glm::normalize(glm::cross(normal, u));
  return shapes::squares(n, [&](const dvec3& p) { return (2 * p.x - 1) * half * u + (2 * p.y - 1) * half * v; });
}

TEST(FastMarching, ExactNextToTheSurfaceAndFirstOrderBeyond) {
  const TriangleMesh mesh = shapes::torus(48);
  const double tolerance = 0.25;
  double last = 1;
  for (const double precision : {3.0, 6.0, 12.0}) {
    const DistanceGrid grid = marched(mesh, tolerance, precision), truth = exact(mesh, tolerance, precision);
    EXPECT_LT(judge(grid, truth, grid.spacing).error, 1e-5);
    const Judged all = judge(grid, truth, tolerance - 0.5 * grid.spacing);
    EXPECT_EQ(all.wrong_sign, 0);
    EXPECT_LT(all.error, 0.5) << "spacings";
    EXPECT_GT(all.error, 0.01) << "is a march and no second scatter";
    const double error = all.error * grid.spacing;
    EXPECT_LT(error, 0.75 * last) << "falls with the spacing";
    last = error;
  }
}

TEST(FastMarching, APlaneAlongTheGridIsExact) {
  const DistanceGrid grid = marched(shapes::grid(2), 0.2, 8);
  int marched_nodes = 0;
  double error = 0;
  for_nodes(grid, [&](std::size_t i, const dvec3& p) {
    if (p.x < 0 || p.y < 0 || p.x > 1 || p.y > 1 || std::abs(p.z) > 0.19) return;
    marched_nodes += grid.triangle[i] == DistanceGrid::kNone;
    error = std::max(error, std::abs(grid.distance[i] - p.z));
  });
  EXPECT_GT(marched_nodes, 1000);
  EXPECT_LT(error, 1e-6);
}

TEST(FastMarching, StopsBeyondTheStopAndHoldsTheBandThere) {
  const TriangleMesh mesh = shapes::torus(48);
  DistanceGrid grid = laid_out(mesh, 0.2, 8);
  const float band = static_cast<float>(grid.band);
  for (const double stop : {0.08, 0.2}) {
    fast_marching(mesh, grid, stop);
    EXPECT_EQ(static_cast<float>(grid.band), band);
    int within = 0, beyond = 0, too_far = 0, marched_nodes = 0, far_triangles = 0;
    for_nodes(grid, [&](std::size_t i, const dvec3&) {
      const float d = std::abs(grid.distance[i]);
      within += d <= stop;
      beyond += d > stop && d != band;
      too_far += !(d <= band);
      marched_nodes += d <= stop && grid.triangle[i] == DistanceGrid::kNone;
      far_triangles += d > 1.01 * grid.spacing && grid.triangle[i] != DistanceGrid::kNone;
    });
    EXPECT_EQ(beyond, 1) << "the node that ended it";
    EXPECT_GT(within, 1000);
    EXPECT_EQ(too_far, 0) << "never infinity";
    EXPECT_GT(marched_nodes, 1000);
    EXPECT_EQ(far_triangles, 0) << "only the initial nodes have a triangle";
  }
}

TEST(FastMarching, EveryNodeOfAClosedMeshHasTheRightSign) {
  for (const TriangleMesh& mesh : {shapes::torus(24, 0.05), shapes::box(3), shapes::soup(shapes::torus(24))}) {
    // The tolerance is a tenth of the torus' tube and less of the box: most inner nodes are never reached.
    const DistanceGrid grid = marched(mesh, 0.04, 1.5), truth = exact(mesh, 0.04, 1.5);
    int inside = 0, unlike = 0;
    for_nodes(grid, [&](std::size_t i, const dvec3&) {
      unlike += std::signbit(grid.distance[i]) != std::signbit(truth.distance[i]);
      inside += std::signbit(grid.distance[i]);
    });
    EXPECT_EQ(unlike, 0);
    EXPECT_GT(inside, 1000);
  }
  const DistanceGrid box = marched(shapes::box(3), 0.04, 1.5);
  int wrong = 0;
  for_nodes(box, [&](std::size_t i, const dvec3& p) {
    const dvec3 out = glm::abs(p - 0.5) - 0.5;
    wrong += std::signbit(box.distance[i]) != (std::max({out.x, out.y, out.z}) < -1e-6);
  });
  EXPECT_EQ(wrong, 0);
}

TEST(FastMarching, ThreadsAndInstructionsDoNotChangeABit) {
  const TriangleMesh mesh = shapes::torus(40, 0.02);
  const DistanceGrid one = marched(mesh, 0.05, 2);
  const DistanceGrid three = marched(mesh, 0.05, 2, 3);
  EXPECT_EQ(one.distance, three.distance);
  EXPECT_EQ(one.triangle, three.triangle);
  const Simd best = simd_path();
  simd_path() = Simd::portable;
  const DistanceGrid portable = marched(mesh, 0.05, 2);
  simd_path() = best;
  EXPECT_EQ(one.distance, portable.distance);
}

TEST(FastMarching, DegenerateMeshes) {
  const DistanceGrid segment = marched({{{0, 0, 0}, {1, 0.2, 0.3}}, {{0, 1, 0}}}, 0.1, 2);
  EXPECT_GE(*std::min_element(segment.distance.begin(), segment.distance.end()), 0) << "no inside without a face";
  // A cell larger than the mesh.
  const DistanceGrid coarse = marched(shapes::grid(1), 1.0, 0.1);
  const auto inside = std::count_if(coarse.distance.begin(), coarse.distance.end(), [](float d) { return d < 0; });
  EXPECT_GT(inside, 0);
}

TEST(FastMarching, IsCancelled) {
  Progress progress;
  const TriangleMesh mesh = shapes::torus(24);
  DistanceGrid grid = laid_out(mesh, 0.3, 8);
  fast_marching(mesh, grid, 0.3, 1, &progress);
  EXPECT_STREQ(progress.stage(), "marching");
  EXPECT_GT(progress.fraction(), 0.5);
  progress.cancel();
  EXPECT_THROW(fast_marching(mesh, grid, 0.3, 1, &progress), Cancelled);
}

/// The share of the marched nodes within the tolerance whose sign is not that of `inside`.
template <class Inside>
double wrong_share(const TriangleMesh& mesh, double tolerance, double precision, Inside&& inside) {
  const DistanceGrid grid = marched(mesh, tolerance, precision);
  int wrong = 0, count = 0;
  for_nodes(grid, [&](std::size_t i, const dvec3& p) {
    if (std::abs(grid.distance[i]) > tolerance || grid.triangle[i] != DistanceGrid::kNone) return;
    ++count, wrong += std::signbit(grid.distance[i]) != inside(p);
  });
  EXPECT_GT(count, 1000);
  return wrong / double(count);
}

TEST(FastMarching, OpenMeshesAreExtruded) {
  const dvec3 normal = glm::normalize(dvec3(1, 2, 3));
  for (const double tolerance : {0.1, 0.5}) {
    EXPECT_LT(wrong_share(tilted_plate(normal, 0.5), tolerance, 40 * tolerance,
                          [&](const dvec3& p) { return glm::dot(p, normal) < 0; }),
              0.005)
        << "but for nodes on the plane itself: copied along the grid, signs are wrong at 12 % of them";
  }
}

TEST(FastMarching, SignsOfAnOpenMeshStandUpToTwiceTheRadiusOfItsHole) {
  for (const double hole : {0.25, 0.5}) {
    const double from = std::asin(hole);
    const TriangleMesh mesh = shapes::squares(48, [&](const dvec3& p) {
      const double u = 2 * std::numbers::pi * p.y, v = glm::mix(from, std::numbers::pi, p.x);
      return dvec3(std::sin(v) * std::cos(u), std::sin(v) * std::sin(u), std::cos(v));
    });
    for (const double share : {0.5, 1.0, 1.8}) {
      const double wrong =
          wrong_share(mesh, share * hole, 16 * share * hole, [](const dvec3& p) { return glm::length(p) < 1; });
      EXPECT_LT(wrong, 0.005) << "hole " << hole << ", tolerance " << share << " of it";
    }
  }
}

}  // namespace
