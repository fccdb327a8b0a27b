// SPDX-License-Identifier: GPL-3.0-or-later
// Every operation while an allocation fails: the exception comes out, what was there before is as it was, and the next
// call gives what it always gives.
#include <gtest/gtest.h>

#include <functional>
#include <new>
#include <vector>

#include "check/certificate.h"
#include "decimation/decimation.h"
#include "failing_allocations.h"
#include "field/display_grid.h"
#include "field/display_tree.h"
#include "many.h"
#include "measure/deviation.h"
#include "measure/hausdorff.h"
#include "motion/constrain.h"
#include "motion/deformation.h"
#include "motion/guard.h"
#include "motion/smoothing.h"
#include "repair/close_holes.h"
#include "shapes.h"
#include "topology/area_and_volume.h"
#include "topology/crossings.h"
#include "topology/solidity.h"
#include "topology/wedges.h"

namespace {

using namespace tolvol;
using namespace tolvol::allocations;
using glm::dvec3;

void add(Numbers& numbers, const std::vector<dvec3>& points) {
  for (const dvec3& p : points) numbers.insert(numbers.end(), {p.x, p.y, p.z});
}

void add(Numbers& numbers, const std::vector<glm::uvec3>& triangles) {
  for (const glm::uvec3& t : triangles) numbers.insert(numbers.end(), {double(t.x), double(t.y), double(t.z)});
}

const StoredSpace kStored(glm::dmat4(1), Storage::float32);

struct Scene {
  explicit Scene(unsigned n = across(10)) : mesh(shapes::torus(n, 0.02)) {}

  TriangleMesh mesh;
  ToleranceVolume volume{mesh.vertices, mesh.triangles, kStored, 0.08, {.precision = 1, .threads = 1}};
  std::vector<std::uint32_t> faces = shapes::indices(mesh);
  std::vector<dvec3> wish = pushed(0.3);

  /// Every third vertex by up to so much.
  std::vector<dvec3> pushed(double by) const {
    std::vector<dvec3> result = mesh.vertices;
    for (std::size_t v = 0; v < result.size(); v += 3) result[v] += by * dvec3(0.1 * double(v % 7), 0.3, 0.5);
    for (dvec3& p : result) p = rounded_to_float32(p);
    return result;
  }
  Numbers decimated(DecimationOptions options) const {
    const DecimationResult result = decimate(mesh.vertices, mesh.triangles, kStored, &volume, options);
    Numbers numbers;
    add(numbers, result.vertices);
    add(numbers, result.triangles);
    return numbers;
  }
};

TEST(Allocation, DecimationInEveryForm) {
  const Scene scene;
  for (const unsigned threads : {1u, 2u}) {
    for (const bool two_sided : {true, false}) {
      DecimationOptions options;
      options.two_sided = two_sided, options.threads = threads;
      EXPECT_GT(fail_allocations([&] { return scene.decimated(options); }, 0.1), 100);
    }
  }
  DecimationOptions options;
  options.placement = DecimationOptions::Placement::subset, options.threads = 1;
  EXPECT_GT(fail_allocations([&] { return scene.decimated(options); }, 0.1), 100);
  options.effort = DecimationOptions::Effort::thorough;
  EXPECT_GT(fail_allocations([&] { return scene.decimated(options); }, 0.5), 100);
}

TEST(Allocation, ThoroughWithOptimalPlacement) {
  const Scene scene(kSanitized ? 5 : 6);  // without sanitizers one decimation of the other takes as long as eight
  DecimationOptions options;
  options.effort = DecimationOptions::Effort::thorough, options.threads = 1;
  EXPECT_GT(fail_allocations([&] { return scene.decimated(options); }, 3), 100);
}

TEST(Allocation, CloseHoles) {
  const Scene scene(10);
  std::vector<glm::uvec3> rest = scene.mesh.triangles;
  for (const int gone : {150, 60, 42, 41, 40}) rest.erase(rest.begin() + gone);
  for (const unsigned threads : {1u, 2u}) {
    CloseHolesOptions options;
    options.threads = threads;
    EXPECT_GT(fail_allocations(
                  [&] {
                    const HoleClosingResult result =
                        close_holes(scene.mesh.vertices, rest, kStored, scene.volume, options);
                    EXPECT_EQ(result.count(LoopOutcome::closed), 3u);
                    Numbers numbers;
                    add(numbers, result.triangles);
                    return numbers;
                  },
                  0.1),
              20);
  }
}

TEST(Allocation, FactsAboutASurface) {
  const Scene scene;
  const std::vector<dvec3> tangled = scene.pushed(2);
  for (const unsigned threads : {1u, 2u}) {
    EXPECT_GT(fail_allocations([&] {
                Team team(threads);
                Numbers numbers;
                for (const glm::uvec2& pair : crossings(tangled, scene.mesh.triangles, 1000, team, nullptr).pairs) {
                  numbers.insert(numbers.end(), {double(pair.x), double(pair.y)});
                }
                return numbers;
              }),
              5);
    EXPECT_GT(fail_allocations([&] {
                Team team(threads);
                const Solidity found = solidity(tangled, scene.mesh.triangles, team);
                const AreaAndVolume extent =
                    area_and_volume(tangled, scene.mesh.triangles, found.shell_of, glm::dmat3(1));
                return Numbers{double(found.shells), double(found.open_edges), extent.area, extent.volume};
              }),
              5);
  }
}

TEST(Allocation, SeamsAndIslands) {
  const Scene scene;
  EXPECT_GT(fail_allocations([&] {
              std::vector<float> values;  // a seam around the torus
              for (std::size_t i = 0; i < scene.mesh.triangles.size(); ++i) {
                values.insert(values.end(), 3, i < scene.mesh.triangles.size() / 2 ? 0.0f : 1.0f);
              }
              const std::vector<std::uint32_t> labels = wedge_labels(scene.mesh.triangles, values, 1);
              std::vector<glm::uvec3> wedges;
              for (std::size_t i = 0; i < labels.size(); i += 3) {
                wedges.emplace_back(labels[i], labels[i + 1], labels[i + 2]);
              }
              const std::vector<std::uint32_t> islands = island_labels(scene.mesh.triangles, wedges);
              Numbers numbers(labels.begin(), labels.end());
              numbers.insert(numbers.end(), islands.begin(), islands.end());
              return numbers;
            }),
            10);
}

TEST(Allocation, VolumeAndChecks) {
  const Scene scene;
  const auto distances = [&](unsigned threads, Field field) {
    const ToleranceVolume volume(scene.mesh.vertices, scene.mesh.triangles, kStored, 0.08,
                                 {.precision = 1, .threads = threads, .field = field});
    Numbers numbers(volume.grid().distance.begin(), volume.grid().distance.end());
    const std::vector<float> with_signs = volume.signed_distance();
    numbers.insert(numbers.end(), with_signs.begin(), with_signs.end());
    return numbers;
  };
  for (const unsigned threads : {1u, 2u}) {
    EXPECT_GT(fail_allocations([&] { return distances(threads, Field::scatter); }), 10);
    EXPECT_GT(fail_allocations([&] { return distances(threads, Field::fast_marching); }), 10);
    EXPECT_GT(fail_allocations([&] {
                Numbers numbers(scene.wish.size());
                parallel_for(numbers.size(), 16, threads, [&](std::size_t begin, std::size_t end) {
                  for (std::size_t i = begin; i < end; ++i) {
                    numbers[i] =
                        scene.volume.hierarchy().nearest(scene.volume.frame().from_world(scene.wish[i])).distance;
                  }
                });
                return numbers;
              }),
              0);
  }
  const auto verdicts = [&](unsigned threads) {
    std::vector<std::int32_t> groups(scene.mesh.triangles.size());
    for (std::size_t i = 0; i < groups.size(); ++i) groups[i] = std::int32_t(i / 2);
    const std::vector<Verdict> found =
        Certificate(scene.volume).check_groups({scene.wish, kStored, scene.faces}, groups, {threads, nullptr});
    Numbers numbers;
    for (const Verdict verdict : found) numbers.push_back(double(verdict));
    return numbers;
  };
  for (const unsigned threads : {1u, 2u}) {
    EXPECT_GT(fail_allocations([&] { return verdicts(threads); }), 5);
  }
  EXPECT_GT(fail_allocations([&] {
              const DisplayGrid display(scene.volume.reference(), false, scene.volume.frame_tolerance(),
                                        {.threads = 1});
              return Numbers(display.grid.distance.begin(), display.grid.distance.end());
            }),
            5);
}

TEST(Allocation, WhatAViewportShows) {
  const Scene scene;
  const std::vector<double> edges{-0.05, 0.0, 0.05};
  for (const unsigned threads : {1u, 2u}) {
    EXPECT_GT(fail_allocations([&] {
                const DisplayTree tree(scene.volume.reference(), false);
                Numbers numbers = area_shares(tree, scene.wish, scene.mesh.triangles, edges, threads);
                for (const glm::vec4& c : tree.corners) numbers.insert(numbers.end(), {c.x, c.y, c.z});
                for (const dvec3& p : scene.wish) numbers.push_back(tree.distance(p, 10));
                return numbers;
              }),
              5);
  }
}

TEST(Allocation, Motion) {
  const Scene scene;
  for (const unsigned threads : {1u, 2u}) {
    // Threads allocate in another order each time, so that a place is not found again.
    const auto fail = [&](const std::function<Numbers()>& operation) {
      return threads == 1 ? fail_each_place(operation) : fail_allocations(operation, is_full_run() ? 0 : 0.05);
    };
    EXPECT_GT(fail([&] {
                const ConstrainResult result = constrain(scene.mesh.vertices, scene.wish, scene.faces, 3, kStored,
                                                         scene.volume, {.threads = threads});
                EXPECT_GT(result.held_back, 0u);
                Numbers numbers = result.factors;
                add(numbers, result.vertices);
                return numbers;
              }),
              20);
    EXPECT_GT(fail([&] {
                SmoothingOptions options;
                options.threads = threads, options.iterations = 2;
                Numbers numbers;
                add(numbers,
                    smooth(scene.mesh.vertices, scene.mesh.triangles, kStored, &scene.volume, options).vertices);
                return numbers;
              }),
              20);
  }
}

TEST(Allocation, Deformation) {
  const Scene scene(6);
  Lattice lattice;
  lattice.size = glm::uvec3(4);
  lattice.domain = glm::dmat4(4);
  lattice.domain[3] = glm::dvec4(-2, -2, -2, 1);
  lattice.points = rest_points(lattice.size, lattice.domain);
  for (std::size_t i = 0; i < lattice.points.size(); i += 3) lattice.points[i].z += 1;
  DeformationOptions options;
  options.threads = 1;
  using Mode = DeformationOptions::Mode;
  for (const Mode mode : {Mode::blocked, Mode::farthest, Mode::pull_back}) {
    options.mode = mode;
    const auto deformed = [&] {
      const DeformationResult result =
          deform(scene.mesh.vertices, scene.faces, 3, kStored, &scene.volume, LatticeDeformation(lattice), options);
      EXPECT_GT(result.held_back, 0u);
      Numbers numbers;
      add(numbers, result.vertices);
      return numbers;
    };
    EXPECT_GT(mode == Mode::pull_back ? fail_each_place(deformed) : fail_allocations(deformed, 3), 10);
  }
}

TEST(Allocation, AGuardKeepsItsState) {
  const Scene scene;
  const std::vector<float> start = shapes::flat(scene.mesh.vertices), wish = shapes::flat(scene.wish);
  const Guard::Options options{Outside::error, false, PullBack::Crossings::keep_out, 90, 1, nullptr};
  const auto made = [&] { return Guard(start, scene.faces, 3, glm::dmat4(1), scene.volume, options).vertex_count(); };
  EXPECT_GT(fail_allocations([&] { return Numbers{double(made())}; }), 10);

  Guard guard(start, scene.faces, 3, glm::dmat4(1), scene.volume, options);
  const auto correction_of_the_wish = [&] {
    const Guard::Correction correction = guard.constrain(wish);
    Numbers numbers(correction.vertices.begin(), correction.vertices.end());
    numbers.insert(numbers.end(), correction.positions.begin(), correction.positions.end());
    return numbers;
  };
  const Numbers expected = correction_of_the_wish();
  EXPECT_GT(expected.size(), 10u);
  const std::vector<float> other = shapes::flat(scene.pushed(0.03));
  for (const std::function<void()>& call :
       {std::function<void()>([&] { guard.constrain(wish); }), std::function<void()>([&] { guard.reset(other); })}) {
    // Calls with the n-th allocation failing. Returns whether there was one. The state is then that before the call.
    const auto reached = [&](long n) {
      guard.reset(start);
      allocations_left = n;
      bool failed = false;
      try {
        call();
      } catch (const std::bad_alloc&) {
        failed = true;
      }
      if (allocations_left.exchange(-1) >= 0) return false;
      if (failed) {
        EXPECT_EQ(correction_of_the_wish(), expected) << "after allocation " << n << " failed";
      }
      return true;
    };
    if (kSanitized || is_full_run()) {
      for (long n = 0; reached(n) && !testing::Test::HasFailure();) n += 1 + long(kLeastGrowth * double(n));
    } else {
      guard.reset(start), call(), guard.reset(start);  // The first call makes the scratch of this thread larger.
      for (const long n : Places(call).chosen) ASSERT_TRUE(reached(n) && !testing::Test::HasFailure()) << n;
    }
  }
}

TEST(Allocation, Measures) {
  const Scene scene;
  const TriangleMesh other{scene.wish, scene.mesh.triangles};
  for (const unsigned threads : {1u, 2u}) {
    EXPECT_GT(fail_allocations([&] {
                const HausdorffInterval found = hausdorff(other, scene.mesh, {{}, threads, nullptr});
                return Numbers{found.lower, found.upper};
              }),
              10);
  }
  EXPECT_GT(fail_allocations(
                [&] {
                  DeviationOptions options;
                  options.threads = 1, options.pieces = 2000;
                  const Deviation found = deviation(other, scene.mesh, options);
                  return Numbers{found.mean.value, found.rms.value};
                },
                4),
            10);
}

}  // namespace
