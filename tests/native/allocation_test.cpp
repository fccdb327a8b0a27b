// SPDX-License-Identifier: GPL-3.0-or-later
// Every operation while the n-th allocation fails, for all n of its run, for those of each place in the code, or for n
// that grow by a share of themselves: the exception comes out, what was there before is as it was, and the next call
// gives what it always gives.
#include <execinfo.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <functional>
#include <map>
#include <new>
#include <set>
#include <utility>
#include <vector>

#include "check/certificate.h"
#include "decimation/decimation.h"
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

std::atomic<long> allocations_left{-1};  // the one after these fails; negative: none does

using Callers = std::array<void*, 16>;
std::vector<Callers>* recorded = nullptr;  // who allocates, one after another; null: nobody wants to know

void* allocate(std::size_t size, std::size_t alignment) {
  if (std::vector<Callers>* const record = std::exchange(recorded, nullptr)) {
    Callers callers{};
    backtrace(callers.data(), int(callers.size()));
    record->push_back(callers);
    recorded = record;
  }
  // Once: what is allocated while the exception is on its way succeeds.
  if (allocations_left.load(std::memory_order_relaxed) >= 0 && allocations_left.fetch_sub(1) == 0)
    throw std::bad_alloc();
  size = (std::max<std::size_t>(size, 1) + alignment - 1) / alignment * alignment;
  if (void* const memory = std::aligned_alloc(alignment, size)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size, __STDCPP_DEFAULT_NEW_ALIGNMENT__); }
void* operator new[](std::size_t size) { return allocate(size, __STDCPP_DEFAULT_NEW_ALIGNMENT__); }
void* operator new(std::size_t size, std::align_val_t alignment) { return allocate(size, std::size_t(alignment)); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return allocate(size, std::size_t(alignment)); }
// The sanitizers have allocators of their own for these, whose memory the functions below could not free.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  try {
    return operator new(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
void* operator new[](std::size_t size, const std::nothrow_t& nothrow) noexcept { return operator new(size, nothrow); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace {

using namespace tolvol;
using glm::dvec3;

/// Where an operation ended, in numbers.
using Numbers = std::vector<double>;

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
  std::vector<std::uint32_t> faces = indices(mesh);
  std::vector<dvec3> wish = pushed(0.3);

  static std::vector<std::uint32_t> indices(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> result;
    for (const glm::uvec3& t : mesh.triangles) result.insert(result.end(), {t.x, t.y, t.z});
    return result;
  }
  /// Every third vertex by up to so much.
  std::vector<dvec3> pushed(double by) const {
    std::vector<dvec3> result = mesh.vertices;
    for (std::size_t v = 0; v < result.size(); v += 3) result[v] += by * dvec3(0.1 * double(v % 7), 0.3, 0.5);
    for (dvec3& p : result) p = rounded_to_float32(p);
    return result;
  }
  std::vector<float> flat(const std::vector<dvec3>& points) const {
    std::vector<float> result;
    for (const dvec3& p : points) result.insert(result.end(), {float(p.x), float(p.y), float(p.z)});
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

constexpr double kLeastGrowth = kSanitized ? 0.5 : 0;

/// Calls `operation` with the n-th allocation failing and then, if there was an n-th, once more: it must give what it
/// gave at first. Returns whether there was one and all is well.
bool survives(const std::function<Numbers()>& operation, long n, const Numbers& expected) {
  bool failed = false;
  allocations_left = n;
  try {
    operation();
  } catch (const std::bad_alloc&) {
    failed = true;
  }
  const bool reached = allocations_left.exchange(-1) < 0;
  EXPECT_TRUE(reached || !failed) << n;
  if (!reached) return false;
  const bool same = operation() == expected;
  EXPECT_TRUE(same) << "another result after allocation " << n << " failed";
  return same;
}

/// Does so until a run has no n-th. `growth`: n grows by so much of itself, for what takes long; at least by
/// kLeastGrowth. Returns how many allocations there were, at least.
long fail_allocations(const std::function<Numbers()>& operation, double growth = 0) {
  growth = std::max(growth, kLeastGrowth);
  const Numbers expected = operation();
  EXPECT_FALSE(expected.empty());
  long n = 0;
  while (survives(operation, n, expected)) n += 1 + long(growth * double(n));
  return n;
}

/// The first, the second and the last allocation of each place: of the same line, called from the same lines.
/// `operation` must work on one thread, in the same way each time.
struct Places {
  std::set<long> chosen;
  long number = 0, allocations = 0;

  explicit Places(const std::function<void()>& operation) {
    std::vector<Callers> calls;
    recorded = &calls;
    operation();
    recorded = nullptr;
    std::map<Callers, std::vector<long>> places;
    for (std::size_t n = 0; n < calls.size(); ++n) places[calls[n]].push_back(long(n));
    for (const auto& [callers, at] : places) chosen.insert({at.front(), at[at.size() > 1], at.back()});
    number = long(places.size()), allocations = long(calls.size());
  }
};

/// Does so, on one thread, with the allocations of Places; in a full run with all of them. Returns the number of
/// places, or of allocations.
long fail_each_place(const std::function<Numbers()>& operation) {
  if (kSanitized || is_full_run()) return fail_allocations(operation);
  const Numbers expected = operation();
  EXPECT_FALSE(expected.empty());
  const Places places([&] { operation(); });
  for (const long n : places.chosen) {
    if (!survives(operation, n, expected)) {
      ADD_FAILURE() << "allocation " << n << " of " << places.allocations;
      break;
    }
  }
  return places.number;
}

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
  const std::vector<float> start = scene.flat(scene.mesh.vertices), wish = scene.flat(scene.wish);
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
  const std::vector<float> other = scene.flat(scene.pushed(0.03));
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
