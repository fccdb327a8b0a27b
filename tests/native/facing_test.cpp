// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/facing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "base/parallel.h"
#include "check/certificate.h"
#include "check/tolerance_volume.h"
#include "geometry/closest_point.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kRight = std::numbers::pi / 2;
constexpr double kError = 1e-15;

double angle_between(const dvec3& a, const dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

TEST(Facing, BoundsEveryAngleFromAbove) {
  shapes::Random random(1);
  for (int i = 0; i < 20'000; ++i) {
    const dvec3 a = glm::normalize(random.point());
    // Half of the pairs are nearly equal or nearly opposite.
    const double spread = i % 2 ? 1 : std::pow(10, -8 * random.share());
    const dvec3 b = glm::normalize((i % 4 < 2 ? a : -a) + spread * random.point());
    const double angle = angle_between(a, b), bound = angle_bound(glm::dot(a, b));
    ASSERT_GE(bound, angle);
    ASSERT_LE(bound, angle + 0.02);
    if (angle < 0.1) {
      ASSERT_LE(bound, angle + 2e-5);
    }
  }
}

TEST(Facing, NormalsThatRoundingCouldTurnAreNotSure) {
  const dvec3 a(0, 0, 0), b(1, 0, 0);
  const auto sure = [&](const dvec3& c, double error) { return sure_normal(a, b, c, error).has_value(); };
  EXPECT_TRUE(sure({0, 1, 0}, kError));
  EXPECT_TRUE(sure({0.5, 1e-6, 0}, kError));
  EXPECT_FALSE(sure({0.5, 1e-9, 0}, kError)) << "a needle";
  EXPECT_FALSE(sure({0.5, 1e-6, 0}, 1e-9)) << "the corners may be elsewhere";
  EXPECT_FALSE(sure({0.5, 0, 0}, kError));
  EXPECT_FALSE(sure(a, kError));
  EXPECT_FALSE(sure_normal(a, a, a, 0).has_value());
  EXPECT_FALSE(sure({std::numeric_limits<double>::quiet_NaN(), 1, 0}, kError));
}

TEST(Facing, NoLimitAdmitsALargerAngle) {
  shapes::Random random(2);
  const TriangleMesh flat{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0, 0}}, {{0, 1, 2}, {0, 1, 3}}};
  for (const double limit : {1e-9, 1e-6, 0.01, 0.5, kRight, 2.0, 3.1}) {
    Team team(2);
    const FacingRule rule(flat, kError, kError, limit, team);
    int admitted = 0;
    for (int i = 0; i < 2'000; ++i) {
      const double angle = std::min(limit * (1 + 0.2 * (random.share() - 0.5)), std::numbers::pi);
      const double turn = 2 * std::numbers::pi * random.share();
      const dvec3 normal(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle));
      Facing facing(rule, normal, limit);
      EXPECT_FALSE(facing.admits(1)) << "a degenerate triangle is no witness";
      if (!facing.admits(0)) continue;
      ++admitted;
      EXPECT_LE(angle, limit);
      facing.begin();
      facing.take(0);
      EXPECT_GE(facing.angle(), angle - 1e-15);
      EXPECT_LE(facing.angle(), limit);
    }
    if (limit > 1e-5) {
      EXPECT_GT(admitted, 500) << limit;
    }
  }
}

/// Two squares, one above the other, whose fronts face outwards.
struct Wall {
  explicit Wall(double thickness) {
    const TriangleMesh top = shapes::squares(8, [&](const dvec3& p) { return p + dvec3(0, 0, thickness); });
    mesh = shapes::joined(shapes::turned(shapes::grid(8)), top);
    volume.emplace(mesh.vertices, mesh.triangles, StoredSpace(glm::dmat4(1), Storage::float64), 0.1,
                   ToleranceVolume::Options{.precision = 8});
    certificate.emplace(volume->witnesses(), volume->grid(), volume->hierarchy(), volume->provable(kError),
                        volume->frame_tolerance());
    Team team(2);
    rule.emplace(volume->reference(), kError, kError, kRight, team);
  }

  /// What is proved of a triangle whose corners are in the world, by a hostile hint: the triangle right below it.
  double bound(const dvec3& a, const dvec3& b, const dvec3& c, bool faces) const {
    const StoredSpace space = StoredSpace(glm::dmat4(1), Storage::float64).in(volume->frame());
    const dvec3 corners[3] = {space.frame(a), space.frame(b), space.frame(c)};
    const dvec3 anywhere(std::numeric_limits<double>::infinity());
    std::optional<Facing> facing;
    if (faces) facing.emplace(*rule, *sure_normal(corners[0], corners[1], corners[2], kError), kRight);
    const auto below = certificate->nearest((corners[0] + corners[1] + corners[2]) * (1.0 / 3), 1.0).triangle;
    const double ordered = certificate->bound(corners, anywhere, glm::uvec3(below), facing ? &*facing : nullptr);
    if (facing && ordered != TriangleCertificate::kUnproved) {
      EXPECT_LE(facing->angle(), kRight);
    }
    Facing* const admits = facing ? &*facing : nullptr;
    dvec3 open(std::numeric_limits<double>::quiet_NaN());
    const double any = certificate->bound_in_any_order(corners, anywhere, glm::uvec3(below), admits, &open);
    if (any == TriangleCertificate::kUnproved) {
      EXPECT_FALSE(certificate->nearest_point(open, certificate->limit(), admits)) << "nothing near it is admitted";
      const auto found = certificate->nearest_point(open, 10 * certificate->limit(), admits);
      EXPECT_TRUE(found && glm::distance(*found, open) > certificate->limit());
      EXPECT_TRUE(certificate->nearest_point(open, certificate->limit(), nullptr)) << "though the other side is near";
    }
    EXPECT_EQ(ordered == TriangleCertificate::kUnproved, any == TriangleCertificate::kUnproved);
    EXPECT_EQ(certificate->point_outside(corners, admits).has_value(), any == TriangleCertificate::kUnproved);
    return ordered;
  }

  TriangleMesh mesh;
  std::optional<ToleranceVolume> volume;
  std::optional<TriangleCertificate> certificate;
  std::optional<FacingRule> rule;
};

TEST(CertifiedFacing, TheOtherSideOfAWallIsNoWitness) {
  const Wall thick(0.3), thin(0.05);
  const dvec3 a(0.1, 0.1, 0), b(0.8, 0.2, 0), c(0.2, 0.9, 0), up(0, 0, 0.3);
  for (const Wall* wall : {&thick, &thin}) {
    for (const bool faces : {false, true}) {
      EXPECT_NE(wall->bound(a, c, b, faces), TriangleCertificate::kUnproved) << "it faces as the bottom does";
    }
    EXPECT_NE(wall->bound(a, b, c, false), TriangleCertificate::kUnproved);
  }
  EXPECT_EQ(thick.bound(a, b, c, true), TriangleCertificate::kUnproved) << "turned over, and the top is too far";
  EXPECT_NE(thick.bound(a + up, b + up, c + up, true), TriangleCertificate::kUnproved);
  // The bottom is nearest, but the top is near enough, too.
  const double bound = thin.bound(a, b, c, true);
  EXPECT_NE(bound, TriangleCertificate::kUnproved);
  EXPECT_GE(bound, 0.999 * 0.05 * thin.volume->frame().scale()) << "the distance to the witness, not to the nearest";
}

TEST(CertifiedFacing, ATriangleWithAPointOutsideHasNoProof) {
  const Wall wall(0.08);
  const StoredSpace space = StoredSpace(glm::dmat4(1), Storage::float64).in(wall.volume->frame());
  shapes::Random random(3);
  int unproved = 0, shown = 0;
  for (int i = 0; i < 2'000; ++i) {
    dvec3 corners[3];
    for (dvec3& p : corners) p = space.frame({random.share(), random.share(), 0.3 * random.share() - 0.1});
    const std::optional<dvec3> normal = sure_normal(corners[0], corners[1], corners[2], kError);
    if (!normal) continue;
    Facing facing(*wall.rule, *normal, kRight);
    const dvec3 anywhere(std::numeric_limits<double>::infinity());
    const double bound = wall.certificate->bound_in_any_order(corners, anywhere, glm::uvec3(Hierarchy::kNone), &facing);
    const std::optional<dvec3> point = wall.certificate->point_outside(corners, &facing);
    if (point) {
      ASSERT_EQ(bound, TriangleCertificate::kUnproved);
      for (std::uint32_t t = 0; t < wall.volume->reference().triangles.size(); ++t) {
        const TriangleMesh& reference = wall.volume->reference();
        const glm::uvec3& of = reference.triangles[t];
        const dvec3 &a = reference.vertices[of.x], &b = reference.vertices[of.y], &c = reference.vertices[of.z];
        const double distance = std::sqrt(closest_point(*point, a, b, c).distance_squared);
        ASSERT_TRUE(!facing.admits(t) || distance > wall.certificate->limit());
      }
    }
    unproved += bound == TriangleCertificate::kUnproved, shown += point.has_value();
  }
  EXPECT_GT(unproved, 300);
  EXPECT_LT(unproved, 1'800);
  EXPECT_GT(shown, 0.6 * unproved) << "the others have a corner outside, which is not looked at";
}

// The mesh has so many triangles that several threads take some of them and of the nodes, and some without a normal.
TEST(Facing, ThreadsFindTheSameNormalsAndBounds) {
  TriangleMesh mesh = shapes::torus(200, 0.1);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 11) {
    mesh.vertices.push_back(mesh.vertices[mesh.triangles[t].x] + dvec3(1e-13));
    mesh.triangles[t].y = std::uint32_t(mesh.vertices.size() - 1);
  }
  const Hierarchy hierarchy(mesh);
  Team one(1), three(3);
  FacingRule alone(mesh, kError, kError, kRight, one), shared(mesh, kError, kError, kRight, three);
  alone.bound_normals(hierarchy, one), shared.bound_normals(hierarchy, three);
  EXPECT_GT(alone.unsure, 1'000u);
  EXPECT_EQ(shared.unsure, alone.unsure);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const bool has_normal = !std::isnan(alone.normals[t].x);
    ASSERT_TRUE(has_normal ? shared.normals[t] == alone.normals[t] : std::isnan(shared.normals[t].x));
  }
  shapes::Random random(3);
  std::size_t admitted = 0;
  for (std::uint32_t node = 0; node < hierarchy.node_count(); ++node) {
    const dvec3 normal = glm::normalize(random.point());
    const bool may = alone.may_face(node, normal, 0.9);
    ASSERT_EQ(shared.may_face(node, normal, 0.9), may);
    admitted += may;
  }
  EXPECT_GT(admitted, hierarchy.node_count() / 100);
  EXPECT_LT(admitted, hierarchy.node_count() / 2);
}

TEST(Facing, FindsTheNearestThatIsAdmitted) {
  shapes::Random random(5);
  const TriangleMesh mesh = shapes::torus(24, 0.1);
  const Hierarchy hierarchy(mesh);
  Team team(2);
  FacingRule rule(mesh, kError, kError, kRight, team);
  for (std::size_t t = 0; t < rule.normals.size(); t += 7) rule.normals[t] = -rule.normals[t];
  rule.normals[3] = dvec3(std::numeric_limits<double>::quiet_NaN());
  rule.bound_normals(hierarchy, team);
  int found = 0;
  for (int i = 0; i < 2'000; ++i) {
    const dvec3 p = random.point(), normal = glm::normalize(random.point());
    const double radius = random.share(), limit = 0.1 + 3 * random.share();
    const Facing facing(rule, normal, limit);
    const auto admits = [&](std::uint32_t t) { return facing.admits(t); };
    const std::uint32_t expected = hierarchy.nearest_if(p, admits, radius).triangle;
    ASSERT_EQ(facing.nearest(hierarchy, p, radius).triangle, expected);
    ASSERT_EQ(facing.nearest(hierarchy, p, radius, random.below(100)).triangle, expected) << "with a hint";
    found += expected != Hierarchy::kNone;
  }
  EXPECT_GT(found, 200);
  EXPECT_LT(found, 1'800);
}

TEST(Facing, AMeshThatLooksAwayCostsASearchNothing) {
  const TriangleMesh plate = shapes::grid(100);
  const Hierarchy hierarchy(plate);
  Team team(2);
  FacingRule rule(plate, kError, kError, kRight, team);
  const Facing turned(rule, {0, 0, -1}, kRight), tilted(rule, glm::normalize(dvec3(1, 0, -0.1)), kRight);
  const dvec3 p(0.5, 0.5, 0.1);
  EXPECT_GT(turned.nearest(hierarchy, p, 10).nodes, 1'000u) << "what a search costs without the normals' bounds";
  rule.bound_normals(hierarchy, team);
  for (const Facing& facing : {turned, tilted}) {
    const Hierarchy::Nearest nearest = facing.nearest(hierarchy, p, 10);
    EXPECT_EQ(nearest.triangle, Hierarchy::kNone);
    EXPECT_EQ(nearest.nodes, 1u);
  }
}

TEST(Facing, ASearchEndsAtWhatIsEnough) {
  // All of a sphere is about as far from its centre.
  const TriangleMesh sphere = shapes::sphere(60);
  const Hierarchy hierarchy(sphere);
  Team team(2);
  FacingRule rule(sphere, kError, kError, kRight, team);
  rule.bound_normals(hierarchy, team);
  const Facing facing(rule, {0, 0, 1}, kRight);
  const dvec3 p(0.001, 0.002, 0.003);
  const Hierarchy::Nearest nearest = facing.nearest(hierarchy, p, 2);
  EXPECT_GT(nearest.nodes, 1'000u) << "the nearest";
  EXPECT_EQ(facing.nearest(hierarchy, p, 2, Hierarchy::kNone, [](std::uint32_t) { return false; }).triangle,
            nearest.triangle);
  const Hierarchy::Nearest any = facing.nearest(hierarchy, p, 2, Hierarchy::kNone, [](std::uint32_t) { return true; });
  EXPECT_TRUE(facing.admits(any.triangle));
  EXPECT_LT(any.nodes, 50u);
  const Hierarchy::Nearest hinted =
      facing.nearest(hierarchy, p, 2, nearest.triangle, [](std::uint32_t) { return true; });
  EXPECT_EQ(hinted.triangle, nearest.triangle);
  EXPECT_EQ(hinted.nodes, 1u) << "the hint is tried first";
}

TEST(CertifiedFacing, WhereAllIsNearAProofEndsAtAnyWitness) {
  // The tolerance is larger than the sphere. Its nearest triangles to the middle would take a look at all of it.
  const TriangleMesh sphere = shapes::sphere(80);
  const StoredSpace space(glm::dmat4(1), Storage::float64);
  const ToleranceVolume volume(sphere.vertices, sphere.triangles, space, 1.3);
  const StoredSpace in_frame = space.in(volume.frame());
  const DistanceGrid no_grid;  // The hierarchy finds all triangles.
  const TriangleCertificate certificate(volume.witnesses(), no_grid, volume.hierarchy(), volume.provable(0),
                                        volume.refutable(0));
  Team team(2);
  FacingRule rule(volume.reference(), kError, kError, kRight, team);
  rule.bound_normals(volume.hierarchy(), team);
  const glm::uvec3 no_hints(Hierarchy::kNone);
  const dvec3 unknown(TriangleCertificate::kUnproved);
  const dvec3 corners[3] = {in_frame.frame({-1e-5, -1e-5, 0}), in_frame.frame({1e-5, -1e-5, 0}),
                            in_frame.frame({0, 1e-5, 0})};
  Facing facing(rule, *sure_normal(corners[0], corners[1], corners[2], kError), kRight);
  EXPECT_GE(polls_of([&] { facing.nearest(volume.hierarchy(), corners[0], 1); }), 2u) << "the nearest";
  EXPECT_EQ(polls_of([&] { EXPECT_FALSE(certificate.is_open(corners[0], &facing)); }), 0u);
  EXPECT_EQ(polls_of([&] {
              EXPECT_NE(certificate.bound_in_any_order(corners, unknown, no_hints, &facing),
                        TriangleCertificate::kUnproved);
            }),
            0u);
}

TEST(CertifiedFacing, CornersProveNothingByTrianglesThatAreNotAdmitted) {
  const Wall thick(0.3);
  const StoredSpace space = StoredSpace(glm::dmat4(1), Storage::float64).in(thick.volume->frame());
  // So small that the distances of the corners bound all of its points.
  const dvec3 corners[3] = {space.frame({0.3, 0.3, 0}), space.frame({0.301, 0.3, 0}), space.frame({0.3, 0.301, 0})};
  const dvec3 distances(0);
  EXPECT_NE(thick.certificate->bound(corners, distances), TriangleCertificate::kUnproved);
  Facing facing(*thick.rule, *sure_normal(corners[0], corners[1], corners[2], kError), kRight);
  const auto below = thick.certificate->nearest(corners[0], 1.0).triangle;
  for (const glm::uvec3& triangles : {glm::uvec3(below), glm::uvec3(Hierarchy::kNone)}) {
    facing.set_corners(triangles);
    EXPECT_EQ(thick.certificate->bound(corners, distances, glm::uvec3(Hierarchy::kNone), &facing),
              TriangleCertificate::kUnproved);
  }
}

}  // namespace
