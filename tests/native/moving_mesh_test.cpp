// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/moving_mesh.h"

#include <gtest/gtest.h>

#include <cmath>

#include "polls.h"
#include "shapes.h"

namespace tolvol {
namespace {

using glm::dvec3;

/// One large face over a plane of squares as wide as the tolerance. The plane has a pit: where the face is lifted, it
/// leaves the tolerance there first.
class FaceOverPit {
 public:
  FaceOverPit(double tolerance, double angle)
      : tolerance_(tolerance),
        plane_(plane_with_pit(tolerance)),
        volume_(plane_.vertices, plane_.triangles, space_, tolerance),
        mesh_(volume_, space_, faces_, 3, 3, 1) {
    EXPECT_TRUE(mesh_.start(corners_, angle, {}, nullptr).outside.empty());
    mesh_.measure(faces_around_, nullptr);
  }
  /// Tries the first corner so many tolerances higher, and takes it back.
  bool lift(double tolerances, MovingMesh::Blame& blame) {
    const bool done =
        mesh_.try_alone(0, mesh_.space().frame(corners_[0] + dvec3(0, 0, tolerances * tolerance_)), blame);
    mesh_.take_back(0);
    return done;
  }

 private:
  static TriangleMesh plane_with_pit(double tolerance) {
    TriangleMesh mesh = shapes::grid(static_cast<unsigned>(2 / tolerance));
    for (dvec3& p : mesh.vertices) {
      p = {2 * p.x - 1, 2 * p.y - 1, 0};
      if (std::hypot(p.x + 0.4, p.y + 0.5) < 1.3 * tolerance) p.z = -0.8 * tolerance;
    }
    return mesh;
  }

  const StoredSpace space_{glm::dmat4(1), Storage::float64};
  const std::vector<dvec3> corners_{{-0.8, -0.8, 0}, {0.8, -0.7, 0}, {-0.1, 0.8, 0}};
  const std::vector<std::uint32_t> faces_{0, 1, 2}, faces_around_{0};
  double tolerance_;
  TriangleMesh plane_;
  ToleranceVolume volume_;
  MovingMesh mesh_;
};

TEST(MovingMesh, AFaceThatRefusesAgainCostsOneLook) {
  for (const double angle : {180.0, 90.0}) {
    FaceOverPit face(0.025, angle);
    MovingMesh::Blame blame;
    EXPECT_GE(polls_of([&] { EXPECT_FALSE(face.lift(0.9, blame)); }), 2) << "the search for the pit is a long one";
    EXPECT_EQ(polls_of([&] { EXPECT_FALSE(face.lift(0.85, blame)); }), 0) << "the point above it is asked first";
    MovingMesh::Blame none;
    EXPECT_GE(polls_of([&] { EXPECT_FALSE(face.lift(0.85, none)); }), 2) << "nothing is kept elsewhere";
  }
}

TEST(MovingMesh, WhatIsKeptOfARefusalChangesNoAnswer) {
  for (const double angle : {180.0, 90.0}) {
    FaceOverPit face(0.04, angle);
    MovingMesh::Blame blame;
    for (double height = 0.95; height > 0; height -= 0.05) {
      MovingMesh::Blame none;
      const bool expected = face.lift(height, none);
      EXPECT_EQ(face.lift(height, blame), expected) << height;
      if (height > 0.9) {
        EXPECT_FALSE(expected);
      }
      if (height < 0.1) {
        EXPECT_TRUE(expected);
      }
    }
    EXPECT_FALSE(std::isnan(blame.weights.x));
  }
}

TEST(MovingMesh, AFaceThatRefusesAgainIsAskedBeforeTheDistanceOfTheVertex) {
  // The face is about the middle of the upper half of a sphere, which is far to find the nearest point of from there.
  TriangleMesh dome = shapes::sphere(160);
  std::erase_if(dome.triangles, [&](const glm::uvec3& t) {
    return std::min({dome.vertices[t.x].z, dome.vertices[t.y].z, dome.vertices[t.z].z}) < 0.3;
  });
  const StoredSpace space(glm::dmat4(1), Storage::float64);
  const ToleranceVolume volume(dome.vertices, dome.triangles, space, 1.2);
  const std::vector<std::uint32_t> faces{0, 1, 2}, around{0};
  MovingMesh mesh(volume, space, faces, 3, 3, 1);
  const std::vector<dvec3> corners{{0.05, 0, 0}, {0, 0.05, 0}, {-0.05, -0.05, 0}};
  ASSERT_TRUE(mesh.start(corners, 60, {}, nullptr).outside.empty());
  mesh.measure(around, nullptr);
  // These places turn the face over.
  const dvec3 over = mesh.space().frame(dvec3(0.1, 0.1, 0)), again = mesh.space().frame(dvec3(0.11, 0.1, 0));
  MovingMesh::Blame blame;
  EXPECT_GE(polls_of([&] { EXPECT_FALSE(mesh.try_alone(2, over, blame)); }), 1) << "the distance takes a long search";
  EXPECT_EQ(polls_of([&] { EXPECT_FALSE(mesh.try_alone(2, again, blame)); }), 0);
  EXPECT_EQ(mesh.trial(2), mesh.state(2));
  EXPECT_EQ(mesh.step(2), 0);
}

}  // namespace
}  // namespace tolvol
