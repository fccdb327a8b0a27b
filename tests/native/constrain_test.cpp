// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/constrain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "geometry/weld.h"
#include "many.h"
#include "shapes.h"
#include "wishes.h"

namespace {

using namespace tolvol;
using namespace tolvol::wishes;
using Mode = PullBack::Mode;

bool same_bits(const dvec3& a, const dvec3& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// Positions are those of the factors, bit for bit.
void expect_on_the_way(const Scene& scene, const Points& wish, const ConstrainResult& r) {
  ASSERT_EQ(r.vertices.size(), wish.size());
  ASSERT_EQ(r.factors.size(), wish.size());
  std::size_t held_back = 0;
  for (std::size_t v = 0; v < wish.size(); ++v) {
    const dvec3& before = scene.mesh.vertices[v];
    const double f = r.factors[v];
    ASSERT_TRUE(f >= 0 && f <= 1);
    held_back += f < 1;
    const dvec3 expected = f == 1 ? wish[v] : f == 0 ? before : scene.stored(before + f * (wish[v] - before));
    ASSERT_TRUE(same_bits(r.vertices[v], expected)) << v;
  }
  EXPECT_EQ(r.held_back, held_back);
}

std::vector<Scene> scenes() {
  glm::dmat4 mirrored(1), sheared(1), far_away(1), tiny(1e-6), huge(1e6);
  mirrored[0][0] = -1;
  sheared[1][0] = 0.7, sheared[2][1] = -0.4, sheared[0][0] = 3;
  far_away[3] = {5000, -3000, 100, 1};
  tiny[3][3] = huge[3][3] = 1;
  TriangleMesh slivers = shapes::grid(across(22));
  for (dvec3& p : slivers.vertices) p = rounded_to_float32(dvec3(p.x, p.y * 1e-3, 0.05 * std::sin(9 * p.x)));
  TriangleMesh odd = shapes::box(6);  // faces that are points and segments, twice the same, a vertex without a face
  odd.triangles.insert(odd.triangles.end(), {{0, 0, 0}, {0, 1, 1}, odd.triangles[0], odd.triangles[7]});
  odd.vertices.emplace_back(100, 100, 100);
  return {{shapes::torus(across(28), 0.002)},
          {shapes::torus(across(28), 0.02), glm::dmat4(1), Storage::float64},
          {shapes::box(across(8))},
          {shapes::stored(shapes::grid(across(22)))},
          {shapes::soup(shapes::torus(across(18)))},
          {slivers},
          {odd},
          {shapes::torus(across(22)), mirrored},
          {shapes::torus(across(22)), sheared},
          {shapes::torus(across(22)), far_away},
          {shapes::torus(across(22)), tiny},
          {shapes::torus(across(22)), huge},
          {shapes::torus(across(20)), glm::dmat4(1), Storage::float32, 0.05},
          {shapes::joined(shapes::box(6), shapes::grid(6)), glm::dmat4(1), Storage::float32, 10}};
}

TEST(Constrain, APlanePushedFarBeyondReachesTheTolerance) {
  for (const double far : {1.05, 3.0, 1e3, 1e30}) {
    const Scene plane{shapes::grid(20), glm::dmat4(1), Storage::float64};
    const Points wish = plane.wish([&](std::size_t) { return dvec3(0, 0, far); });
    const ConstrainResult r = run(plane, wish);
    for (const dvec3& p : r.vertices) {
      EXPECT_GE(p.z, 0.95 * plane.tolerance());
      EXPECT_LE(p.z, plane.tolerance());
    }
    EXPECT_EQ(r.held_back, wish.size());
  }
}

TEST(Constrain, AWishThatIsInsideIsGranted) {
  const Scene scene{shapes::torus(40)};
  const Points wish = scene.wish(noise(0.05));
  for (const Mode mode : {Mode::pull_back, Mode::reset}) {
    const ConstrainResult r = run(scene, wish, {.mode = mode});
    EXPECT_EQ(r.held_back, 0u);
    for (std::size_t v = 0; v < wish.size(); ++v) ASSERT_TRUE(same_bits(r.vertices[v], wish[v]));
  }
}

TEST(Constrain, EveryFaceIsInsideOnEveryMesh) {
  int number = 0;
  for (const Scene& scene : scenes()) {
    SCOPED_TRACE(testing::Message() << "scene " << number++);
    const auto volume = scene.volume();
    const Points wish = scene.wish(noise(0.6));
    for (const bool two_sided : {false, true}) {
      using Crossings = PullBack::Crossings;
      const ConstrainResult pulled = run(scene, *volume, wish, {.two_sided = two_sided, .crossings = Crossings::allow});
      const ConstrainResult reset =
          run(scene, *volume, wish, {.mode = Mode::reset, .two_sided = two_sided, .crossings = Crossings::allow});
      expect_inside(scene, *volume, pulled, two_sided);
      expect_inside(scene, *volume, reset, two_sided);
      expect_on_the_way(scene, wish, pulled);
      expect_on_the_way(scene, wish, reset);
      EXPECT_GT(pulled.held_back, 0u);
      EXPECT_GT(reset.held_back, pulled.held_back);
      for (std::size_t v = 0; v < wish.size(); ++v) {
        EXPECT_TRUE(reset.factors[v] == 0 || reset.factors[v] == 1);
        if (!two_sided) {
          EXPECT_GE(pulled.factors[v], reset.factors[v]);
        }
      }
    }
  }
}

/// For each vertex, its faces.
std::vector<std::vector<std::uint32_t>> rings(const Scene& scene) {
  std::vector<std::vector<std::uint32_t>> result(scene.mesh.vertices.size());
  for (std::uint32_t f = 0; f < scene.mesh.triangles.size(); ++f) {
    for (int k = 0; k < 3; ++k) result[scene.mesh.triangles[f][k]].push_back(f);
  }
  return result;
}

TEST(Constrain, OnlyVerticesOfFailingFacesAreHeldBack) {
  const Scene scene{shapes::torus(40)};
  const Points wish = scene.wish(noise(0.5));
  const ConstrainResult r = run(scene, wish, {.max_normal_angle = 180});
  const std::vector<Verdict> wished =
      verdicts(*scene.volume(1 - 2e-4), scene.space(), wish, shapes::indices(scene.mesh));
  const auto ring = rings(scene);
  std::size_t untouched = 0;
  for (std::size_t v = 0; v < wish.size(); ++v) {
    // A face that would be inside with all its wishes granted fails only where one of them is not.
    const bool failed = std::any_of(ring[v].begin(), ring[v].end(), [&](std::uint32_t f) {
      const glm::uvec3 t = scene.mesh.triangles[f];
      bool other = false;
      for (int k = 0; k < 3; ++k) other = other || (t[k] != v && r.factors[t[k]] < 1);
      return wished[f] != Verdict::inside || other;
    });
    if (!failed) {
      EXPECT_EQ(r.factors[v], 1) << v;
      ++untouched;
    }
  }
  EXPECT_GT(untouched, wish.size() / 4);
  EXPECT_GT(r.held_back, 50u);
}

TEST(Constrain, NoFactorCanRiseAlone) {
  for (const double deviation : {0.5, 3.0}) {
    const Scene scene{shapes::torus(40)};
    const Points wish = scene.wish(noise(deviation));
    const ConstrainResult r =
        run(scene, wish, {.two_sided = false, .crossings = PullBack::Crossings::allow, .max_normal_angle = 180});
    const auto ring = rings(scene);
    // Nearer to its end than the headroom that is kept no vertex has to go.
    const auto volume = scene.volume(1 - 2e-4);
    std::size_t tried = 0;
    for (std::size_t v = 0; v < wish.size(); ++v) {
      if (r.factors[v] == 1) continue;
      const double f = std::min(1.0, r.factors[v] + 1.0 / 64);
      Points raised = r.vertices;
      raised[v] = f == 1 ? wish[v] : scene.stored(scene.mesh.vertices[v] + f * (wish[v] - scene.mesh.vertices[v]));
      std::vector<std::uint32_t> faces;
      for (const std::uint32_t i : ring[v]) {
        for (int k = 0; k < 3; ++k) faces.push_back(scene.mesh.triangles[i][k]);
      }
      EXPECT_FALSE(all_inside(verdicts(*volume, scene.space(), raised, faces))) << v << " at " << r.factors[v];
      ++tried;
    }
    EXPECT_GT(tried, 50u);
  }
}

// A soup has a vertex of its own for each corner.
TEST(Constrain, VerticesAtOnePlaceMoveAsOne) {
  Scene scene = scenes().front();
  scene.mesh = shapes::soup(scene.mesh);
  const std::vector<std::uint32_t> place = weld_equal_positions(scene.mesh.vertices);
  auto shake = noise(3);
  Points ways(place.size());
  for (dvec3& way : ways) way = shake(0);
  const Points wish = scene.wish([&](std::size_t v) { return ways[place[v]]; });
  for (const auto mode : {Mode::pull_back, Mode::settle, Mode::reset}) {
    for (const auto crossings : {PullBack::Crossings::keep_out, PullBack::Crossings::allow}) {
      ConstrainOptions options;
      options.mode = mode, options.crossings = crossings;
      const ConstrainResult r = run(scene, wish, options);
      expect_inside(scene, r, true);
      expect_on_the_way(scene, wish, r);
      EXPECT_GT(r.held_back, 0u);
      if (mode != Mode::reset) {
        EXPECT_LT(r.held_back, place.size());
      }
      for (std::size_t v = 0; v < place.size(); ++v) {
        ASSERT_EQ(r.factors[v], r.factors[place[v]]);
        ASSERT_TRUE(same_bits(r.vertices[v], r.vertices[place[v]]));
      }
    }
  }
  // One of them alone is asked to go elsewhere, and may.
  Points apart = scene.mesh.vertices;
  const auto copy =
      std::find_if(place.begin(), place.end(),
                   [&](const std::uint32_t& p) { return p != static_cast<std::uint32_t>(&p - place.data()); }) -
      place.begin();
  apart[copy] = scene.wish([](std::size_t) { return dvec3(0.1); })[copy];
  EXPECT_EQ(run(scene, apart).held_back, 0u);
}

TEST(Constrain, WhatHoldsTJunctionsTogetherStays) {
  Scene scene = scenes().front();
  // Two plates side by side, one of which has twice as many vertices along the edge where they meet.
  TriangleMesh coarse = shapes::grid(4), fine = shapes::grid(8);
  for (dvec3& p : fine.vertices) p.x += 1;
  scene.mesh = shapes::stored(shapes::joined(coarse, fine));
  const Points wish = scene.wish([](std::size_t v) { return dvec3(0, 0, v % 3 * 0.2); });
  const ConstrainResult r = run(scene, wish);
  expect_inside(scene, r, true);
  std::size_t held = 0;
  for (std::size_t v = 0; v < wish.size(); ++v) {
    const bool between = scene.mesh.vertices[v].x == 1;
    held += between;
    EXPECT_TRUE(same_bits(r.vertices[v], between ? scene.mesh.vertices[v] : wish[v])) << v;
  }
  ASSERT_EQ(r.warnings.size(), 1u);
  EXPECT_EQ(r.warnings.front(), std::to_string(held) + " vertices hold T-junctions together and cannot move");
}

TEST(Constrain, TheResultDoesNotDependOnThreads) {
  const Scene scene{shapes::torus(across(60))};
  const Points wish = scene.wish(noise(0.6));
  const ConstrainResult one = run(scene, wish, {.threads = 1});
  for (const unsigned threads : {2u, 3u, 7u}) {
    const ConstrainResult more = run(scene, wish, {.threads = threads});
    EXPECT_EQ(one.factors, more.factors);
    EXPECT_TRUE(std::equal(one.vertices.begin(), one.vertices.end(), more.vertices.begin(), same_bits));
  }
}

TEST(Constrain, CornersThatStayAreChecked) {
  // A single vertex of a fine plate far in front of it would be a spike between neighbours that stay.
  Scene scene{shapes::stored(shapes::grid(10))};
  Points wish = scene.mesh.vertices;
  wish[60] += dvec3(0, 0, 10 * scene.tolerance());
  const ConstrainResult r = run(scene, wish);
  expect_inside(scene, r, true);
  EXPECT_EQ(r.held_back, 1u);
  EXPECT_NEAR(r.factors[60], 0.1, 0.005);
}

}  // namespace
