// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/new_crossings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "polls.h"
#include "shapes.h"
#include "topology/double_sheets.h"

namespace {

using glm::dvec3;
using tolvol::Corners;
using tolvol::faces_cross;
using tolvol::NearFaces;
using tolvol::NewCrossings;
using tolvol::Team;
using tolvol::TriangleMesh;
using Face = NewCrossings::Face;
using Removed = NewCrossings::Removed;

/// A mesh, and what a change of it is asked about.
struct Scene {
  explicit Scene(TriangleMesh m, std::vector<Corners> fixed = {})
      : input(std::move(m)),
        now(input),
        crossings({input.triangles, input.vertices}, {now.triangles, now.vertices}, std::move(fixed)) {}

  NearFaces near(const std::vector<std::uint8_t>& hubs = {}) const {
    std::vector<std::uint32_t> faces(crossings.face_count());
    std::iota(faces.begin(), faces.end(), 0u);
    Team alone(1);
    return {faces, [&](std::size_t i) { return crossings.corners(faces[i]); }, hubs, alone};
  }
  bool none(const std::vector<Face>& faces, const std::vector<Removed>& removed = {}) {
    return crossings.none(near(), faces, removed, trial);
  }
  /// Whether one vertex may go there.
  bool may_move(std::uint32_t vertex, const dvec3& to) {
    std::vector<Face> faces;
    for (std::uint32_t i = 0; i < now.triangles.size(); ++i) {
      Corners corners = crossings.corners(i);
      bool has = false;
      for (int k = 0; k < 3; ++k) {
        if (now.triangles[i][k] == vertex) corners[k] = to, has = true;
      }
      if (has) faces.push_back({i, corners});
    }
    return none(faces);
  }

  TriangleMesh input, now;
  NewCrossings crossings;
  NewCrossings::Trial trial;
};

/// Two plates, a hair apart.
TriangleMesh wall(double thickness, unsigned n = 4) {
  TriangleMesh mesh = tolvol::shapes::grid(n);
  const auto count = static_cast<unsigned>(mesh.vertices.size());
  for (unsigned i = 0; i < count; ++i) mesh.vertices.push_back(mesh.vertices[i] + dvec3(0, 0, thickness));
  const std::size_t faces = mesh.triangles.size();
  for (std::size_t i = 0; i < faces; ++i) {
    const glm::uvec3 t = mesh.triangles[i];
    mesh.triangles.emplace_back(count + t.x, count + t.z, count + t.y);
  }
  return mesh;
}

constexpr unsigned kMiddle = 12;  // of 5 x 5 vertices

TEST(NewCrossings, AVertexStopsAtTheOtherSideOfAWall) {
  Scene scene(wall(0.01));
  EXPECT_TRUE(scene.may_move(kMiddle, dvec3(0.52, 0.51, 0.0099)));
  EXPECT_FALSE(scene.may_move(kMiddle, dvec3(0.52, 0.51, 0.01)));  // it touches
  EXPECT_FALSE(scene.may_move(kMiddle, dvec3(0.5, 0.5, 0.5)));
  EXPECT_TRUE(scene.may_move(kMiddle, dvec3(0.5, 0.5, -0.5)));
}

TEST(NewCrossings, FacesAroundAVertexMayNotFoldOntoEachOther) {
  Scene scene(tolvol::shapes::grid(4));
  EXPECT_TRUE(scene.may_move(kMiddle, dvec3(0.6, 0.55, 0)));
  EXPECT_FALSE(scene.may_move(kMiddle, dvec3(0.9, 0.9, 0)));   // beyond its ring, in the plane
  EXPECT_FALSE(scene.may_move(kMiddle, dvec3(0.75, 0.5, 0)));  // a face becomes degenerate
}

TEST(NewCrossings, FixedFacesAreInTheWay) {
  Scene scene(tolvol::shapes::grid(4), {Corners{dvec3(0.4, 0.4, 0.2), dvec3(0.6, 0.4, 0.2), dvec3(0.5, 0.7, 0.2)}});
  EXPECT_TRUE(scene.may_move(kMiddle, dvec3(0.5, 0.5, 0.19)));
  EXPECT_FALSE(scene.may_move(kMiddle, dvec3(0.5, 0.5, 0.21)));
}

// A spike through a plate crosses it from the start; it may go on to do so, and nothing else may.
TEST(NewCrossings, WhatCrossedMayGoOnToCross) {
  TriangleMesh mesh = tolvol::shapes::grid(4);
  const auto n = static_cast<unsigned>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {dvec3(0.6, 0.55, -1), dvec3(0.62, 0.55, 1), dvec3(0.61, 0.56, 1)});
  mesh.triangles.emplace_back(n, n + 1, n + 2);
  Scene scene(mesh);
  EXPECT_TRUE(scene.may_move(kMiddle, dvec3(0.5, 0.5, 0.1)));  // the same face of the plate is pierced
  EXPECT_TRUE(scene.may_move(n, dvec3(0.6, 0.55, -2)));
  EXPECT_FALSE(scene.may_move(n, dvec3(0.2, 0.2, -2)));  // another face would be pierced
}

// What a removed face stood for is stood for by its successor, from the change on that removes it.
TEST(NewCrossings, ARemovedFaceHandsOverWhatItCrossed) {
  TriangleMesh mesh;
  mesh.vertices = {dvec3(0, 0, 0),      dvec3(1, 0, 0),     dvec3(1, 1, 0),    dvec3(0, 1, 0),
                   dvec3(0.2, 0.7, -1), dvec3(0.2, 0.7, 1), dvec3(0.2, 0.8, 1)};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}};
  const Face larger{0, {dvec3(0, 0, 0), dvec3(1, 0, 0), dvec3(0, 1, 0)}};
  {
    Scene scene(mesh);
    EXPECT_FALSE(scene.none({larger}));
    EXPECT_TRUE(scene.none({larger}, {{1, 0}}));
  }
  Scene scene(mesh);
  scene.crossings.hand_over(std::vector<Removed>{{1, 0}});
  EXPECT_TRUE(scene.none({larger}, {{1, 0}}));
}

// A bar pierces both triangles of a square, and the edge between them is flipped: each new triangle needs an input face
// that the bar crossed, and both stand for one. Where one triangle stands for all of them, it gives one away.
TEST(NewCrossings, InputFacesAreSharedOutAsTheyAreNeeded) {
  TriangleMesh mesh;
  mesh.vertices = {dvec3(0, 0, 0), dvec3(1, 0, 0),      dvec3(1, 1, 0),     dvec3(0, 1, 0),    dvec3(2, 0, 0),
                   dvec3(2, 1, 0), dvec3(0.4, 0.3, -1), dvec3(0.4, 0.3, 1), dvec3(0.4, 0.6, 0)};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {6, 7, 8}};
  Scene scene(mesh);
  ASSERT_TRUE(faces_cross(scene.crossings.corners(0), scene.crossings.corners(3)));
  ASSERT_TRUE(faces_cross(scene.crossings.corners(1), scene.crossings.corners(3)));
  const Face lower{0, {dvec3(0, 0, 0), dvec3(1, 0, 0), dvec3(0, 1, 0)}},
      far{2, {dvec3(0.3, 0.45, -0.5), dvec3(2, 0, 0), dvec3(2, 1, 0.5)}};
  // The face far away never crossed the bar. It may do so once it has what the removed triangle stood for.
  ASSERT_TRUE(faces_cross(far.corners, scene.crossings.corners(3)));
  EXPECT_FALSE(scene.none({far}));
  EXPECT_FALSE(scene.none({lower, far}));
  const std::vector<Removed> removed{{1, 0}};
  const bool both = scene.none({lower, far}, removed);
  EXPECT_EQ(both, !faces_cross(lower.corners, far.corners));
  ASSERT_TRUE(both);
  ASSERT_EQ(scene.trial.given().size(), 1u);
  EXPECT_EQ(scene.trial.given()[0].to, 2u);
  scene.crossings.hand_over(removed, scene.trial.given());
  EXPECT_TRUE(scene.none({lower, far}, removed));
  EXPECT_TRUE(scene.trial.given().empty()) << "each has what it needs by now";
}

// It has 800 million pairs of faces, of which hardly any is looked at.
TEST(NewCrossings, FacesOfALargeFanAreToldApart) {
  constexpr unsigned kFaces = 40000;
  TriangleMesh fan;
  fan.vertices.push_back(dvec3(0, 0, 1));
  for (unsigned i = 0; i < kFaces; ++i) {
    const double angle = 6.283185307179586 * i / kFaces;
    fan.vertices.push_back(dvec3(std::cos(angle), std::sin(angle), 0));
    fan.triangles.emplace_back(0, 1 + i, 1 + (i + 1) % kFaces);
  }
  Scene scene(fan);
  EXPECT_TRUE(scene.may_move(0, dvec3(0.1, 0.2, 0.9)));
  EXPECT_FALSE(scene.may_move(0, dvec3(1.5, 0.2, 0)));  // it leaves the plane of the rim's inside
}

TEST(NewCrossings, SheetsThatLieOnEachOtherAreExempt) {
  EXPECT_TRUE(Scene(wall(0)).may_move(kMiddle, dvec3(0.55, 0.55, 0)));
  // But not from others.
  TriangleMesh mesh = wall(0);
  const auto n = static_cast<unsigned>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {dvec3(0.6, 0.55, 0.1), dvec3(0.62, 0.55, 1), dvec3(0.61, 0.56, 1)});
  mesh.triangles.emplace_back(n, n + 1, n + 2);
  EXPECT_FALSE(Scene(mesh).may_move(n, dvec3(0.6, 0.55, -0.1)));
}

// Such a face would cross others of the sheet, so that the number of pairs rises that are not of one sheet.
TEST(NewCrossings, AFaceThatStandsForOneOfASheetIsNotOfTheSheet) {
  TriangleMesh mesh = wall(0);
  mesh.triangles.resize(mesh.triangles.size() - 16);  // the rest of the second plate lies on half of the first one
  const auto sheets = tolvol::double_sheets(mesh.vertices, mesh.triangles);
  const std::uint32_t of_sheet = 0, alone = 31;
  ASSERT_NE(sheets[of_sheet], tolvol::kNoSheet);
  ASSERT_EQ(sheets[alone], tolvol::kNoSheet);
  const Corners through{dvec3(0.3, 0.1, -0.1), dvec3(0.4, 0.1, 0.1), dvec3(0.3, 0.2, 0.1)};  // the sheet
  EXPECT_TRUE(Scene(mesh).none({{of_sheet, through}}));
  EXPECT_FALSE(Scene(mesh).none({{alone, through}}));
  EXPECT_FALSE(Scene(mesh).none({{alone, through}}, {{of_sheet, alone}}));
}

TEST(NewCrossings, FacesOfASheetAreToldByThemselves) {
  // Each of two faces stands for 3,200 of its sheet, of which 10 million pairs might be looked at.
  Scene scene(wall(0, 40));
  const auto half = static_cast<std::uint32_t>(scene.now.triangles.size() / 2);
  std::vector<Removed> removed;
  for (std::uint32_t i = 1; i < half; ++i) removed.push_back({i, 0}), removed.push_back({half + i, half});
  scene.crossings.hand_over(removed);
  Team alone(1);
  const std::uint32_t left[] = {0, half};
  const NearFaces near(
      left, [&](std::size_t i) { return scene.crossings.corners(left[i]); }, {}, alone);
  Corners through = scene.crossings.corners(0);
  through[0].z = -0.1, through[1].z = through[2].z = 0.1;
  ASSERT_TRUE(faces_cross(through, scene.crossings.corners(half)));
  const auto may_cross = [&] {
    NewCrossings::Trial trial;
    EXPECT_TRUE(scene.crossings.none(near, std::vector<Face>{{0, through}}, {}, trial));
  };
  may_cross();  // finds what is known from then on
  const std::size_t polls = tolvol::polls_of(may_cross);
  EXPECT_LT(polls, 200u);
}

TEST(NewCrossings, DoubleSheetsAreFoundByPosition) {
  TriangleMesh mesh = wall(0);
  const TriangleMesh apart = wall(0.5, 2);
  const auto n = static_cast<unsigned>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), apart.vertices.begin(), apart.vertices.end());
  for (const glm::uvec3& t : apart.triangles) mesh.triangles.push_back(t + n);
  for (dvec3& p : mesh.vertices) {
    if (&p >= &mesh.vertices[n]) p += 5.0;
  }
  const std::vector<std::uint32_t> sheets = tolvol::double_sheets(mesh.vertices, mesh.triangles);
  for (std::size_t i = 0; i < sheets.size(); ++i) EXPECT_EQ(sheets[i], i < 64 ? 0 : tolvol::kNoSheet);
}

TEST(NewCrossings, ReadsNoFaceOutsideItsBox) {
  Scene scene(wall(0.01));
  scene.trial.begin();
  scene.may_move(kMiddle, dvec3(0.5, 0.5, 0.5));
  scene.may_move(kMiddle, dvec3(0.5, 0.5, -0.25));
  EXPECT_EQ(scene.trial.read().lower, dvec3(0.25, 0.25, -0.25));
  EXPECT_EQ(scene.trial.read().upper, dvec3(0.75, 0.75, 0.5));
  scene.trial.begin();
  EXPECT_TRUE(scene.trial.read().empty());
}

// After a refusal the face that was in the way is asked first, which changes no answer.
TEST(NewCrossings, AnswersDoNotDependOnThoseBefore) {
  Scene scene(wall(0.01));
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(scene.may_move(kMiddle, dvec3(0.5, 0.5, 0.5)));
    EXPECT_TRUE(scene.may_move(kMiddle, dvec3(0.5, 0.5, -0.5)));
    EXPECT_FALSE(scene.may_move(kMiddle, dvec3(0.9, 0.9, 0)));
  }
}

// Blades from one place cut a plate, and a vertex of the plate merges into another. The faces that are left have to
// share out what all stood for. How they do may not depend on whether the blades were searched as faces around a hub:
// which vertices counted as hubs when a tree was built is a matter of chance where several threads change the mesh.
TEST(NewCrossings, WhatIsSharedOutDoesNotDependOnHubs) {
  constexpr std::uint32_t kBlades = 4, kEnd = 13;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> inside(0.26, 0.74);
  std::size_t shared_out = 0;
  for (int scene_number = 0; scene_number < 2000; ++scene_number) {
    TriangleMesh mesh = tolvol::shapes::grid(4);
    const auto plate = static_cast<std::uint32_t>(mesh.triangles.size());
    const auto hub = static_cast<std::uint32_t>(mesh.vertices.size());
    const dvec3 top(0.5, 0.5, 1);
    mesh.vertices.push_back(top);
    std::vector<std::uint8_t> hubs(plate, NearFaces::kNoHub);
    for (std::uint32_t i = 0; i < kBlades; ++i) {
      const dvec3 tip = top + 1.1 * (dvec3(inside(random), inside(random), 0) - top);
      mesh.vertices.push_back(tip), mesh.vertices.push_back(tip + dvec3(0.8 * inside(random), 0.4, 0));
      mesh.triangles.emplace_back(hub, hub + 2 * i + 1, hub + 2 * i + 2);
      hubs.push_back(i % 2 == 1 ? 0 : NearFaces::kNoHub);  // so that the two searches differ in their order
    }
    Scene scene(mesh);
    std::vector<Face> faces;
    std::vector<std::uint32_t> gone;
    for (std::uint32_t i = 0; i < plate; ++i) {
      const glm::uvec3 t = mesh.triangles[i];
      const auto has = [&](std::uint32_t v) { return t.x == v || t.y == v || t.z == v; };
      if (!has(kMiddle)) continue;
      if (has(kEnd)) {
        gone.push_back(i);
        continue;
      }
      Corners corners = scene.crossings.corners(i);
      for (dvec3& corner : corners) {
        if (corner == mesh.vertices[kMiddle]) corner = mesh.vertices[kEnd];
      }
      faces.push_back({i, corners});
    }
    ASSERT_EQ(gone.size(), 2u);
    const std::vector<Removed> removed{{gone[0], faces[0].id}, {gone[1], faces[1].id}};
    NewCrossings::Trial flat, around;
    const bool one = scene.crossings.none(scene.near(), faces, removed, flat);
    EXPECT_EQ(one, scene.crossings.none(scene.near(hubs), faces, removed, around)) << scene_number;
    ASSERT_EQ(flat.given().size(), around.given().size()) << scene_number;
    for (std::size_t i = 0; i < flat.given().size(); ++i) {
      EXPECT_EQ(flat.given()[i].input_face, around.given()[i].input_face) << scene_number;
      EXPECT_EQ(flat.given()[i].to, around.given()[i].to) << scene_number;
    }
    shared_out += !flat.given().empty();
  }
  EXPECT_GT(shared_out, 5u);
}

}  // namespace
