// SPDX-License-Identifier: GPL-3.0-or-later
// Judged by measure/hausdorff.h on what is stored; the operators against direct formulas.
#include "motion/smoothing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "base/errors.h"
#include "check/certificate.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using Options = SmoothingOptions;
using Operator = Options::Operator;
using Weights = Options::Weights;
using Boundary = Options::Boundary;

const StoredSpace kDouble(glm::dmat4(1), Storage::float64), kSingle(glm::dmat4(1), Storage::float32);

SmoothingResult free_smooth(const TriangleMesh& mesh, const Options& options, const StoredSpace& space = kDouble) {
  return smooth(mesh.vertices, mesh.triangles, space, nullptr, options);
}

/// A flat square plate of n x n squares with noise in z, or with noise in the plane as well.
TriangleMesh rough_plate(unsigned n, double noise, double sideways = 0) {
  std::mt19937 engine(4);
  std::normal_distribution<double> normal;
  return shapes::squares(n, [&](const dvec3& p) {
    const double x = normal(engine), y = normal(engine), z = normal(engine);
    return p + dvec3(sideways * x, sideways * y, noise * z);
  });
}

bool same_bits(const std::vector<dvec3>& a, const std::vector<dvec3>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(dvec3)) == 0;
}

TEST(Smoothing, UniformLaplacianIsHalfTheUmbrellaVector) {
  const TriangleMesh mesh = rough_plate(4, 0.1, 0.02);
  const SmoothingResult r =
      free_smooth(mesh, {.iterations = 1, .kind = Operator::laplacian, .weights = Weights::uniform});
  for (unsigned i = 1; i < 4; ++i) {
    for (unsigned j = 1; j < 4; ++j) {
      const unsigned v = i * 5 + j;
      dvec3 mean(0);
      for (const int step : {-1, 1, -5, 5, 6, -6}) mean += mesh.vertices[unsigned(int(v) + step)] / 6.0;
      EXPECT_LT(glm::length(r.vertices[v] - 0.5 * (mean + mesh.vertices[v])), 1e-15);
    }
  }
}

/// The cotangent of the angle at `at` between the other two.
double cotangent(const dvec3& at, const dvec3& a, const dvec3& b) {
  return glm::dot(a - at, b - at) / glm::length(glm::cross(a - at, b - at));
}

TEST(Smoothing, CotangentBilaplacianFollowsItsFormula) {
  for (const bool sheared : {false, true}) {
    glm::dmat4 to_world(1);
    if (sheared) to_world[1][0] = 0.3, to_world[2][2] = 2;  // weights are of the world
    const TriangleMesh mesh = shapes::torus(12, 0.01);
    const StoredSpace space(to_world, Storage::float64);
    const unsigned n = 12;
    const auto at = [n](int i, int j) { return unsigned((i + int(n)) % int(n)) * n + unsigned((j + int(n)) % int(n)); };
    const auto umbrella = [&](int i, int j, const auto& value) {
      // Neighbours in turn; the two corners opposite to an edge are the neighbours before and after.
      const int around[6][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 0}, {-1, -1}, {0, -1}};
      const auto world = [&](unsigned v) { return space.world(mesh.vertices[v]); };
      dvec3 sum(0);
      double total = 0;
      for (int k = 0; k < 6; ++k) {
        const auto neighbour = [&](int m) { return at(i + around[m % 6][0], j + around[m % 6][1]); };
        const unsigned v = at(i, j), to = neighbour(k);
        const double w = cotangent(world(neighbour(k + 1)), world(v), world(to)) +
                         cotangent(world(neighbour(k + 5)), world(v), world(to));
        sum += std::max(w, 0.0) * (value(i + around[k][0], j + around[k][1]) - value(i, j));
        total += std::max(w, 0.0);
      }
      return sum / total;
    };
    const auto position = [&](int i, int j) { return mesh.vertices[at(i, j)]; };
    const auto first = [&](int i, int j) { return umbrella(i, j, position); };
    const SmoothingResult r = free_smooth(mesh, {.iterations = 1}, space);
    for (int i = 0; i < int(n); ++i) {
      for (int j = 0; j < int(n); ++j) {
        const dvec3 expected = position(i, j) - 0.25 * umbrella(i, j, first);
        EXPECT_LT(glm::length(r.vertices[at(i, j)] - expected), 1e-14);
      }
    }
  }
}

TEST(Smoothing, APlaneStaysAPlaneAndCotangentsKeepItsTriangles) {
  TriangleMesh flat = rough_plate(10, 0, 0.01);
  for (dvec3& p : flat.vertices) p = {p.x - p.y / 2, std::sqrt(0.75) * p.y, 0};  // acute triangles
  for (const Operator kind : {Operator::laplacian, Operator::bilaplacian}) {
    const SmoothingResult kept = free_smooth(flat, {.kind = kind});
    const SmoothingResult evened = free_smooth(flat, {.kind = kind, .weights = Weights::uniform});
    EXPECT_LT(kept.largest_motion, 1e-14) << "no curvature, no motion";
    EXPECT_GT(evened.largest_motion, 0.005);
    for (const dvec3& p : evened.vertices) EXPECT_EQ(p.z, 0);
  }
}

double roughness(const std::vector<dvec3>& points) {
  double sum = 0;
  for (const dvec3& p : points) sum += p.z * p.z;
  return std::sqrt(sum / double(points.size()));
}

TEST(Smoothing, NoiseGoesDownWithEveryIterationAndOperator) {
  const TriangleMesh mesh = rough_plate(20, 0.01);
  for (const Operator kind : {Operator::laplacian, Operator::bilaplacian}) {
    for (const Weights weights : {Weights::uniform, Weights::cotangent}) {
      double last = roughness(mesh.vertices);
      for (const unsigned iterations : {1u, 3u, 10u, 40u}) {
        const double now =
            roughness(free_smooth(mesh, {.iterations = iterations, .kind = kind, .weights = weights}).vertices);
        EXPECT_LT(now, last);
        last = now;
      }
    }
  }
}

TEST(Smoothing, TheBilaplacianKeepsTheSizeBetter) {
  const TriangleMesh mesh = shapes::torus(40);
  const auto shrinkage = [&](Operator kind) {
    return hausdorff(mesh, {free_smooth(mesh, {.kind = kind}).vertices, mesh.triangles}).lower;
  };
  EXPECT_LT(shrinkage(Operator::bilaplacian), 0.2 * shrinkage(Operator::laplacian));
}

TEST(Smoothing, WhatStandsOnAnEdgeStaysOnIt) {
  // A rough plate, and triangles that stand with one corner each on the middle of an inner edge.
  const unsigned n = 16;
  TriangleMesh mesh = shapes::grid(n);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) mesh.vertices[v].z = static_cast<double>(7 * v % 5) / 64;
  std::vector<std::array<std::uint32_t, 3>> standing;  // the corner, and the ends of the edge
  for (std::uint32_t i = 3; i < n; i += 4) {
    const std::uint32_t a = i * (n + 1) + i, b = a + 1, foot = static_cast<std::uint32_t>(mesh.vertices.size());
    const dvec3 middle = 0.5 * (mesh.vertices[a] + mesh.vertices[b]);
    for (const double side : {0.0, 0.01, -0.01}) mesh.vertices.push_back(middle + dvec3(side, 0, side == 0 ? 0 : 1));
    mesh.triangles.emplace_back(foot, foot + 1, foot + 2);
    standing.push_back({foot, a, b});
  }
  const SmoothingResult r = free_smooth(mesh, {.kind = Operator::laplacian, .boundary = Boundary::along});
  EXPECT_EQ(r.fixed_t_junctions, 3 * standing.size());
  EXPECT_GT(r.largest_motion, 0.01);
  for (const auto& [foot, a, b] : standing) {
    EXPECT_LT(glm::length(r.vertices[foot] - 0.5 * (r.vertices[a] + r.vertices[b])), 1e-9);
  }
}

TEST(Smoothing, TheBoundaryStaysOrIsSmoothedAlongItself) {
  const unsigned n = 12;
  TriangleMesh mesh = shapes::squares(n, [&](const dvec3& p) {
    const bool zigzag = p.x == 0 && (std::lround(p.y * n) % 2 == 1);
    return p + dvec3(zigzag ? -0.02 : 0, 0, 0.01 * std::sin(40 * p.x * p.y));
  });
  const auto on_boundary = [&](std::size_t v) { return v % (n + 1) % n == 0 || v / (n + 1) % n == 0; };
  for (const Operator kind : {Operator::laplacian, Operator::bilaplacian}) {
    for (const Weights weights : {Weights::uniform, Weights::cotangent}) {
      const SmoothingResult fixed = free_smooth(mesh, {.kind = kind, .weights = weights});
      const SmoothingResult along = free_smooth(mesh, {.kind = kind, .weights = weights, .boundary = Boundary::along});
      EXPECT_EQ(fixed.fixed_boundary, 4 * n);
      EXPECT_EQ(along.fixed_boundary, 0u);
      double worst = 0;
      for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        if (!on_boundary(v)) continue;
        EXPECT_EQ(fixed.vertices[v], mesh.vertices[v]);
        if (v > 2 && v + 3 < n) worst = std::max(worst, std::abs(along.vertices[v].x - along.vertices[v + 1].x));
      }
      EXPECT_LT(worst, 0.01) << "the zigzag was 0.02";
      // Inner vertices do not pull at the boundary: away from its corners, what is straight stays straight.
      const SmoothingResult once =
          free_smooth(mesh, {.iterations = 1, .kind = kind, .weights = weights, .boundary = Boundary::along});
      for (std::size_t v = n * (n + 1) + 3; v + 3 < mesh.vertices.size(); ++v) {
        EXPECT_EQ(once.vertices[v].x, 1);
        EXPECT_NE(once.vertices[v].z, mesh.vertices[v].z);
      }
    }
  }
}

TEST(Smoothing, LockedVerticesAndStrength) {
  const TriangleMesh mesh = shapes::torus(20, 0.02);
  const std::size_t count = mesh.vertices.size();
  const auto locked = std::make_unique<bool[]>(count);
  std::vector<double> strength(count);
  for (std::size_t v = 0; v < count; ++v) locked[v] = v % 7 == 0, strength[v] = double(v % 5) / 4;
  const Options once{.iterations = 1};
  Options with_lock = once, with_strength = once;
  with_lock.locked = {locked.get(), count};
  with_strength.strength = strength;
  const SmoothingResult plain = free_smooth(mesh, once), held = free_smooth(mesh, with_lock),
                        partly = free_smooth(mesh, with_strength);
  for (std::size_t v = 0; v < count; ++v) {
    EXPECT_EQ(held.vertices[v], locked[v] ? mesh.vertices[v] : plain.vertices[v]);
    const dvec3 expected = mesh.vertices[v] + strength[v] * (plain.vertices[v] - mesh.vertices[v]);
    EXPECT_LT(glm::length(partly.vertices[v] - expected), 1e-15);
  }
}

TEST(Smoothing, WhatIsHugeHoldsNothingBack) {
  glm::dmat4 odd(1);
  odd[1][0] = 0.3, odd[2][2] = -2, odd[3] = {10, 20, 30, 1};
  for (const Storage storage : {Storage::float32, Storage::float64}) {
    const TriangleMesh mesh = shapes::torus(30, 0.02);
    const StoredSpace space(odd, storage);
    const ToleranceVolume volume(mesh.vertices, mesh.triangles, space, 3);
    for (const bool reset : {false, true}) {
      const Options options{.iterations = 20, .reset = reset};
      const SmoothingResult bounded = smooth(mesh.vertices, mesh.triangles, space, &volume, options);
      EXPECT_TRUE(same_bits(bounded.vertices, free_smooth(mesh, options, space).vertices));
      EXPECT_EQ(bounded.held_back, std::vector<std::size_t>(20, 0));
    }
  }
}

struct Scene {
  TriangleMesh mesh;
  glm::dmat4 to_world = glm::dmat4(1);
  double percent = 0.4;

  StoredSpace space() const { return {to_world, Storage::float32}; }
  double tolerance() const { return percent / 100 * longest_diagonal(mesh.vertices, mesh.triangles, to_world); }
};

std::vector<Scene> scenes() {
  glm::dmat4 mirrored(1), sheared(1), far_away(1), tiny(1e-6);
  mirrored[0][0] = -1;
  sheared[1][0] = 0.7, sheared[2][1] = -0.4, sheared[0][0] = 3;
  far_away[3] = {5000, -3000, 100, 1};
  tiny[3][3] = 1;
  TriangleMesh needles = rough_plate(across(22), 0.02);
  for (dvec3& p : needles.vertices) p.y *= 1e-3;
  TriangleMesh odd =
      shapes::torus(across(22), 0.02);  // faces that are points and segments, and faces that are there twice
  odd.triangles.insert(odd.triangles.end(), {{0, 0, 0}, {0, 1, 1}, {5, 9, 5}, odd.triangles[7], odd.triangles[8]});
  return {{shapes::torus(across(28), 0.02)},
          {shapes::torus(across(28), 0.02), glm::dmat4(1), 0.1},
          {shapes::stored(rough_plate(across(22), 0.02))},
          {shapes::box(across(8)), glm::dmat4(1), 0.3},
          {shapes::stored(needles), glm::dmat4(1), 0.1},
          {odd},
          {shapes::soup(shapes::torus(across(18), 0.02))},
          {shapes::torus(across(22), 0.02), mirrored},
          {shapes::torus(across(22), 0.02), sheared},
          {shapes::torus(across(22), 0.02), far_away},
          {shapes::torus(across(22), 0.02), tiny}};
}

TEST(Smoothing, EveryResultIsInsideOnEveryMesh) {
  int number = 0;
  for (const Scene& scene : scenes()) {
    const ToleranceVolume volume(scene.mesh.vertices, scene.mesh.triangles, scene.space(), scene.tolerance());
    for (const bool reset : {false, true}) {
      SCOPED_TRACE(testing::Message() << "scene " << number << (reset ? " reset" : " pulled back"));
      const Options options{.iterations = 8,
                            .weights = reset ? Weights::uniform : Weights::cotangent,
                            .boundary = Boundary::along,
                            .reset = reset};
      const SmoothingResult r = smooth(scene.mesh.vertices, scene.mesh.triangles, scene.space(), &volume, options);
      const auto world = [&](std::vector<dvec3> points) {
        for (dvec3& p : points) p = scene.space().world(p);
        return TriangleMesh{points, scene.mesh.triangles};
      };
      const double tolerance = scene.tolerance();
      EXPECT_LE(
          hausdorff(world(r.vertices), world(scene.mesh.vertices), {.bound = tolerance, .threads = 1, .narrow = false})
              .upper,
          tolerance);
      const std::vector<std::uint32_t> indices = shapes::indices(scene.mesh);
      for (const Verdict v : Certificate(volume).check({r.vertices, scene.space(), indices}, {1, nullptr}))
        ASSERT_EQ(v, Verdict::inside);
      for (const dvec3& p : r.vertices) ASSERT_EQ(p, rounded_to_float32(p));
      EXPECT_TRUE(reset || r.largest_motion > 0.5 * tolerance);
      EXPECT_GT(r.held_back.back(), 0u);
      EXPECT_EQ(r.method, "certificate");
    }
    ++number;
  }
}

TEST(Smoothing, PulledBackGoesFartherThanReset) {
  const TriangleMesh mesh = shapes::torus(across(40), 0.02);
  const ToleranceVolume volume(mesh.vertices, mesh.triangles, kSingle, 0.02);
  const auto moved = [&](bool reset) {
    const SmoothingResult r = smooth(mesh.vertices, mesh.triangles, kSingle, &volume, {.reset = reset});
    double sum = 0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) sum += glm::length(r.vertices[v] - mesh.vertices[v]);
    return sum;
  };
  EXPECT_GT(moved(false), 1.02 * moved(true));
}

TEST(Smoothing, VerticesThatCannotMoveTakeLittleWorkInBothDirections) {
  // In the first iterations the edges of the box are rounded until they are at the tolerance. From then on their
  // vertices wish for steps that are several times as long as the tolerance.
  const TriangleMesh mesh = shapes::box(12);
  const ToleranceVolume volume(mesh.vertices, mesh.triangles, kSingle, 0.004);
  const auto polls = [&](bool two_sided) {
    const Options options{.iterations = 30, .two_sided = two_sided, .threads = 1};
    return polls_of([&] {
      const SmoothingResult r = smooth(mesh.vertices, mesh.triangles, kSingle, &volume, options);
      EXPECT_GT(r.held_back.back(), 300u);
    });
  };
  EXPECT_LT(polls(true), 4.5 * polls(false)) << "6.8 times without a limit of their steps";
}

TEST(Smoothing, WhatWasPulledBackGoesAtMostTwiceAsFarNext) {
  glm::dmat4 stretched(1);
  stretched[0][0] = 3;  // The limit is a length of the world.
  const StoredSpace space(stretched, Storage::float64);
  const TriangleMesh mesh = shapes::box(8);
  const double tolerance = 0.004, least = tolerance / 16;
  const ToleranceVolume volume(mesh.vertices, mesh.triangles, space, tolerance);
  const auto way = [&](const dvec3& a, const dvec3& b) { return glm::length(space.world(b) - space.world(a)); };
  // Runs of n and of n + 1 iterations begin alike, and a free iteration of a state gives the wish in it.
  std::vector<std::vector<dvec3>> at{mesh.vertices}, wish{{}};
  std::size_t limited = 0, went_on = 0;
  for (unsigned n = 1; n <= 12; ++n) {
    const SmoothingResult r = smooth(mesh.vertices, mesh.triangles, space, &volume, {.iterations = n});
    wish.push_back(free_smooth({at.back(), mesh.triangles}, {.iterations = 1}, space).vertices);
    at.push_back(r.vertices);
    std::size_t held_back = 0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      held_back += at[n][v] != wish[n][v];
      if (n < 2 || at[n - 1][v] == wish[n - 1][v]) continue;
      const double before = way(at[n - 2][v], at[n - 1][v]), now = way(at[n - 1][v], at[n][v]);
      EXPECT_LE(now, (1 + 1e-9) * std::max(2 * before, least));
      limited += way(at[n - 1][v], wish[n][v]) > 2 * std::max(2 * before, least);
      went_on += before == 0 && now > 0;
    }
    EXPECT_EQ(r.held_back.back(), held_back);
  }
  EXPECT_GT(limited, 0u);
  EXPECT_GT(went_on, 0u) << "a vertex that did not move at all may try again";
}

TEST(Smoothing, TheResultDoesNotDependOnThreads) {
  const TriangleMesh mesh = shapes::torus(across(48), 0.02);
  const ToleranceVolume volume(mesh.vertices, mesh.triangles, kSingle, 0.02);
  for (const ToleranceVolume* bound : {static_cast<const ToleranceVolume*>(nullptr), &volume}) {
    const SmoothingResult one = smooth(mesh.vertices, mesh.triangles, kSingle, bound, {.threads = 1});
    for (const unsigned threads : {2u, 5u}) {
      EXPECT_TRUE(same_bits(one.vertices,
                            smooth(mesh.vertices, mesh.triangles, kSingle, bound, {.threads = threads}).vertices));
    }
  }
}

TEST(Smoothing, VerticesAtOnePlaceMoveAsOne) {
  const TriangleMesh mesh = shapes::torus(20, 0.02), soup = shapes::soup(mesh);
  const SmoothingResult whole = free_smooth(mesh, {}), parts = free_smooth(soup, {});
  EXPECT_EQ(parts.welded, soup.vertices.size() - mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_LT(glm::length(parts.vertices[soup.triangles[t][k]] - whole.vertices[mesh.triangles[t][k]]), 1e-14);
    }
  }
  for (std::size_t i = 1; i < parts.vertices.size(); ++i) {
    for (std::size_t j = 0; j < std::min<std::size_t>(i, 40); ++j)
      EXPECT_EQ(soup.vertices[i] == soup.vertices[j], parts.vertices[i] == parts.vertices[j]);
  }
}

TEST(Smoothing, BranchesStay) {
  TriangleMesh fins = shapes::stored(rough_plate(12, 0.01));
  for (unsigned i = 0; i < 12; ++i) {
    const unsigned a = i * 13 + 6, b = a + 13, n = unsigned(fins.vertices.size());
    fins.vertices.push_back(fins.vertices[a] + dvec3(0, 0, 0.2));
    fins.vertices.push_back(fins.vertices[b] + dvec3(0, 0, 0.2));
    fins.triangles.emplace_back(a, b, n), fins.triangles.emplace_back(b, n + 1, n);
  }
  const SmoothingResult r = free_smooth(fins, {.boundary = Boundary::along});
  EXPECT_EQ(r.fixed_non_manifold, 13u);
  for (unsigned i = 0; i <= 12; ++i) EXPECT_EQ(r.vertices[i * 13 + 6], fins.vertices[i * 13 + 6]);
  EXPECT_GT(r.largest_motion, 0);
}

TEST(Smoothing, OutsideIsAnErrorOrKept) {
  TriangleMesh mesh = shapes::torus(30, 0.01);
  const ToleranceVolume volume(mesh.vertices, mesh.triangles, kSingle, 0.05);
  mesh.vertices[17] = rounded_to_float32(mesh.vertices[17] * 2.0);
  try {
    smooth(mesh.vertices, mesh.triangles, kSingle, &volume, {});
    FAIL();
  } catch (const InvalidInput& error) {
    EXPECT_EQ(std::string(error.what()).find("6 faces are not within the tolerance"), 0u) << error.what();
  }
  const SmoothingResult r = smooth(mesh.vertices, mesh.triangles, kSingle, &volume, {.outside = Outside::keep});
  EXPECT_EQ(r.outside.faces, 6u);
  ASSERT_TRUE(r.outside.first.has_value());
  for (const glm::uvec3& t : mesh.triangles) {
    const bool touched = t.x == 17 || t.y == 17 || t.z == 17;
    for (int k = 0; touched && k < 3; ++k) EXPECT_EQ(r.vertices[t[k]], mesh.vertices[t[k]]);
  }
  EXPECT_GT(r.largest_motion, 0.01);
}

TEST(Smoothing, BadInput) {
  const TriangleMesh mesh = shapes::torus(10);
  const auto refused = [](const auto& call) {
    try {
      call();
    } catch (const InvalidInput& error) {
      return std::string(error.what());
    }
    return std::string("not refused");
  };
  const auto with = [&](const Options& options) { return refused([&] { free_smooth(mesh, options); }); };
  std::vector<double> strength(100, 1);
  EXPECT_EQ(with({.strength = std::span(strength).first(99)}), "strength must have one value for each vertex");
  for (const double bad : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    strength[42] = bad;
    EXPECT_EQ(with({.strength = strength}).find("the strength of vertex 42"), 0u);
  }
  const bool one[1] = {true};
  EXPECT_EQ(with({.locked = one}), "locked must have one value for each vertex");
  TriangleMesh broken = mesh;
  broken.vertices[3].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused([&] { free_smooth(broken, {}); }).find("vertex 3 is not finite"), 0u);
  broken = shapes::box(1);
  for (dvec3& p : broken.vertices) p = std::numeric_limits<double>::max() * (2.0 * p - 1.0);
  EXPECT_NE(refused([&] { free_smooth(broken, {.weights = Weights::uniform}); }).find("too large"), std::string::npos);
  EXPECT_TRUE(same_bits(free_smooth(mesh, {.iterations = 0}).vertices, mesh.vertices));
}

TEST(Smoothing, CanBeCancelled) {
  const TriangleMesh mesh = shapes::torus(20);
  Progress progress;
  progress.cancel();
  EXPECT_THROW(free_smooth(mesh, {.progress = &progress}), Cancelled);
}

}  // namespace
