// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/input_facing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "candidates.h"
#include "decimation/decimation_input.h"
#include "polls.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// Moves points along z so that a plate turns about the y axis through a point.
dvec3 turned(const dvec3& p, double about, double degrees) {
  return p + dvec3(0, 0, (p.x - about) * std::tan(glm::radians(degrees)));
}

// Where the cut turns triangles, nodes of the hierarchy below which all are turned have to be found by the new normals.
TEST(InputFacing, ASearchFindsTrianglesThatTheCutHasTurned) {
  TriangleMesh plate = shapes::grid(40);
  for (glm::uvec3& t : plate.triangles) {
    if (plate.vertices[t.x].x < 0.5) std::swap(t.y, t.z);
  }
  Team team(1);
  const CutMesh cut = cut_to_manifold(plate.vertices, plate.triangles, team);
  ASSERT_GT(cut.reversed_count, 0u);
  const Hierarchy hierarchy(plate);
  FacingRule rule(plate, 0, 0, std::numbers::pi / 2, team);
  rule.bound_normals(hierarchy, team);
  // One half is turned so that it faces as the other.
  const bool is_first = cut.reversed[0];
  const dvec3 above_turned(is_first ? 0.1 : 0.9, 0.4, 0.05);
  const dvec3 normal = is_first ? rule.normals.back() : rule.normals.front();
  EXPECT_GT(rule.nearest(hierarchy, above_turned, normal, kSameSide, 1).distance, 0.3);
  face_as_cut(cut, hierarchy, team, rule);
  EXPECT_NEAR(rule.nearest(hierarchy, above_turned, normal, kSameSide, 1).distance, 0.05, 1e-9);
}

TEST(InputFacing, AFaceKeepsTheLeastAngleThatIsProved) {
  // Slats go through a plate, turned by 60 degrees from it. Farther below is a plate that is turned by 20.
  const TriangleMesh plate = shapes::grid(8);
  TriangleMesh below = plate, slats = shapes::soup(plate);
  for (dvec3& p : below.vertices) p = turned(p, 0.5, 20) - dvec3(0, 0, 0.5);
  for (const glm::uvec3& t : slats.triangles) {
    const double middle = (slats.vertices[t.x].x + slats.vertices[t.y].x + slats.vertices[t.z].x) / 3;
    for (int k = 0; k < 3; ++k) slats.vertices[t[k]] = turned(slats.vertices[t[k]], middle, 60);
  }
  const TriangleMesh reference = shapes::joined(below, slats);
  const ToleranceVolume volume(reference.vertices, reference.triangles, candidates::kIdentity, 1.0);
  DecimationOptions options;
  options.two_sided = false, options.max_normal_angle = 10;
  Team team(1);
  DecimationResult report;
  const DecimationInput input(plate.vertices, plate.triangles, candidates::kIdentity, &volume, options, true, team,
                              report);
  EXPECT_EQ(input.exceeding().size(), plate.triangles.size());
  for (std::uint32_t t = 0; t < plate.triangles.size(); ++t) {
    const double kept = glm::degrees(dynamic_cast<CertifiedBounds&>(*input.bounds()).rule(t).limit);
    EXPECT_GT(kept, 19.99);
    EXPECT_LT(kept, 21.01);
  }
}

// A proof that a face faces its reference proves the face, too, so that the angle costs little more than it.
TEST(InputFacing, FacesAreProvedOnce) {
  shapes::Random random(1);
  const TriangleMesh plate = shapes::grid(2);
  const TriangleMesh reference =
      shapes::squares(100, [&](const dvec3& p) { return p + dvec3(0, 0, 0.001 * random.point().z); });
  const ToleranceVolume volume(reference.vertices, reference.triangles, candidates::kIdentity, 0.005);
  const auto polls_at = [&](double angle) {
    DecimationOptions options;
    options.two_sided = false, options.max_normal_angle = angle;
    Team team(1);
    DecimationResult report;
    return polls_of([&] {
      DecimationInput(plate.vertices, plate.triangles, candidates::kIdentity, &volume, options, true, team, report);
    });
  };
  EXPECT_LT(polls_at(90), 1.2 * polls_at(180));
}

}  // namespace
