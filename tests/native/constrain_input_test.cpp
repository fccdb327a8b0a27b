// SPDX-License-Identifier: GPL-3.0-or-later
// What constrain() takes and refuses: faces of any number of corners, a start that is outside, far wishes, bad input.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "base/errors.h"
#include "base/progress.h"
#include "motion/constrain.h"
#include "shapes.h"
#include "wishes.h"

namespace {

using namespace tolvol;
using namespace tolvol::wishes;

TEST(Constrain, PointsSegmentsAndQuads) {
  // A valley x = 0 between two slopes. Vertices at the same height on either side: points on the slopes are inside,
  // what spans the valley is not.
  const TriangleMesh valley{{{-1, -1, 1}, {-1, 1, 1}, {0, -1, 0}, {0, 1, 0}, {1, -1, 1}, {1, 1, 1}},
                            {{0, 2, 1}, {2, 3, 1}, {2, 4, 3}, {4, 5, 3}}};
  const StoredSpace space(glm::dmat4(1), Storage::float64);
  const ToleranceVolume volume(valley.vertices, valley.triangles, space, 0.05);
  // Corners beside the valley, two of them go up the slopes.
  const Points before{{-0.05, -0.5, 0.05}, {0.05, -0.5, 0.05}, {0.05, 0.5, 0.05}, {-0.05, 0.5, 0.05}};
  Points after = before;
  after[0] = {-0.5, -0.5, 0.5}, after[2] = {0.5, 0.5, 0.5};
  const auto factors = [&](const std::vector<std::uint32_t>& faces, int corners) {
    const ConstrainResult r = constrain(before, after, faces, corners, space, volume, {.two_sided = false});
    EXPECT_TRUE(all_inside(verdicts(volume, space, r.vertices, faces, corners)));
    return r.factors;
  };
  EXPECT_EQ(factors({0, 1, 2, 3}, 1), (std::vector<double>{1, 1, 1, 1}));
  EXPECT_LT(factors({0, 1}, 2)[0], 1) << "a segment across";
  EXPECT_EQ(factors({3, 0}, 2), (std::vector<double>{1, 1, 1, 1})) << "a segment on one slope";
  // Two triangles around the diagonal 1-3 leave out the diagonal 0-2; the quad has both.
  const std::vector<double> split = factors({0, 1, 3, 1, 2, 3}, 3), quad = factors({0, 1, 2, 3}, 4);
  EXPECT_LT(quad[0] + quad[2], split[0] + split[2]);
  EXPECT_EQ(factors({0, 1, 3, 3}, 4), factors({0, 1, 3}, 3)) << "a quad that is a triangle";
}

TEST(Constrain, OutsideIsAnErrorOrKept) {
  const Scene scene{shapes::torus(40)};
  Points before = scene.mesh.vertices;
  before[7] += dvec3(0, 0, 5 * scene.tolerance());
  before[7] = rounded_to_float32(before[7]);
  const Points wish = scene.wish(noise(0.1));
  const auto volume = scene.volume();
  const std::vector<std::uint32_t> faces = shapes::indices(scene.mesh);
  const std::vector<Verdict> found = verdicts(*volume, scene.space(), before, faces);
  const auto first = std::find_if(found.begin(), found.end(), [](Verdict v) { return v != Verdict::inside; });
  const std::ptrdiff_t count = std::count_if(first, found.end(), [](Verdict v) { return v != Verdict::inside; });
  try {
    constrain(before, wish, faces, 3, scene.space(), *volume);
    FAIL();
  } catch (const InvalidInput& error) {
    const std::string expected = std::to_string(count) +
                                 " faces are not within the tolerance of the reference, the first is face " +
                                 std::to_string(first - found.begin());
    EXPECT_EQ(std::string(error.what()).find(expected), 0u) << error.what();
  }
  const ConstrainResult r = constrain(before, wish, faces, 3, scene.space(), *volume, {.outside = Outside::keep});
  EXPECT_EQ(r.outside.faces, std::size_t(count));
  EXPECT_EQ(r.outside.first, std::uint32_t(first - found.begin()));
  const std::vector<Verdict> after = verdicts(*volume, scene.space(), r.vertices, faces);
  std::size_t moved = 0;
  for (std::size_t f = 0; f < found.size(); ++f) {
    EXPECT_EQ(found[f] == Verdict::inside, after[f] == Verdict::inside);
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = scene.mesh.triangles[f][k];
      EXPECT_TRUE(found[f] == Verdict::inside || r.vertices[v] == before[v]);
      moved += r.vertices[v] != before[v];
    }
  }
  EXPECT_GT(moved, before.size());
}

template <class Call>
void expect_refused(Call&& call, const std::string& text) {
  try {
    call();
    ADD_FAILURE() << "not refused: " << text;
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
  }
}

// However far away a wish is, its vertex goes as far towards it as the volume permits.
TEST(Constrain, AFarWishIsAWishLikeOthers) {
  const Scene scene{shapes::torus(20), glm::dmat4(1), Storage::float64};
  const auto reached = [&](double far) {
    Points wish = scene.mesh.vertices;
    wish[5] += far * dvec3(1, 0.3, -0.5), wish[77] += far * dvec3(0, 0, 1), wish[78].x += far;
    const ConstrainResult r = run(scene, wish);
    EXPECT_EQ(r.held_back, 3u) << far;
    for (const std::size_t v : {5, 77, 78}) {
      EXPECT_LT(r.factors[v], 1) << far;
      EXPECT_NE(r.vertices[v], scene.mesh.vertices[v]) << far;
    }
    return r.vertices;
  };
  const Points near = reached(1e6);
  for (const double far : {1e100, 1e154, 1e160, 1e200, 1e300, 1e307}) {
    const Points now = reached(far);
    for (std::size_t v = 0; v < now.size(); ++v) EXPECT_LT(glm::distance(now[v], near[v]), 0.02) << far << ' ' << v;
  }
}

TEST(Constrain, BadInput) {
  const Scene scene{shapes::torus(20)};
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  Points wish = scene.mesh.vertices;
  wish[300].y = nan, wish[17].x = infinity;
  expect_refused([&] { run(scene, wish); }, "the wish for vertex 17 is not finite");
  wish = scene.mesh.vertices;
  wish[5].z = 1.7e308;
  glm::dmat4 scaled(100);
  scaled[3][3] = 1;
  expect_refused([&] { run({shapes::torus(20), scaled, Storage::float64}, wish); }, "vertex 5 is too far away");
  expect_refused([&] { run(scene, Points(3)); }, "after 3");
  Scene broken = scene;
  broken.mesh.vertices[9].x = nan;
  const auto volume = scene.volume();
  const auto with = [&](const Points& before, std::vector<std::uint32_t> faces, int corners) {
    constrain(before, before, faces, corners, scene.space(), *volume, {.two_sided = false});
  };
  expect_refused([&] { with(broken.mesh.vertices, {0, 1, 2}, 3); }, "vertex 9 is not finite");
  expect_refused([&] { with(scene.mesh.vertices, {0, 1, 2, 0, 1, 400}, 3); }, "face 1 uses vertex 400");
  expect_refused([&] { with(scene.mesh.vertices, {0, 1, 2, 3}, 3); }, "whole number of faces");
  expect_refused([&] { with(scene.mesh.vertices, {0, 1, 2, 3, 4}, 5); }, "1 to 4 corners");
  with(scene.mesh.vertices, {}, 3);
  with({}, {}, 3);
  expect_refused([&] { constrain({}, {}, {}, 3, scene.space(), *volume); }, "800 faces of the reference");
}

TEST(Constrain, CoarselyStoredCoordinatesAreNamed) {
  glm::dmat4 far_away(1);
  far_away[3] = {-1e5, 0, 0, 1};
  Scene scene{shapes::torus(20), far_away};
  for (dvec3& p : scene.mesh.vertices) p = rounded_to_float32(p + dvec3(1e5, 0, 0));
  scene.percent = 10;
  EXPECT_EQ(run(scene, scene.mesh.vertices).warnings.size(), 1u);
  scene.percent = 0.2;
  expect_refused([&] { run(scene, scene.mesh.vertices); }, "which are rounded: take at least");
}

TEST(Constrain, CanBeCancelled) {
  const Scene scene{shapes::torus(40)};
  Progress progress;
  progress.cancel();
  EXPECT_THROW(run(scene, scene.wish(noise(0.5)), {.progress = &progress}), Cancelled);
}

}  // namespace
