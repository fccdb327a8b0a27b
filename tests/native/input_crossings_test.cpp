// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/input_crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <span>

#include "polls.h"
#include "shapes.h"

namespace {

using tolvol::InputCrossings;
using tolvol::polls_of;
using tolvol::TriangleMesh;

/// Small triangles at random places, of which some cross a few others. The first ones are there twice, on the same
/// positions, so that they are double sheets.
TriangleMesh messy(unsigned count) {
  TriangleMesh mesh;
  tolvol::shapes::Random random(7);
  for (unsigned i = 0; i < count; ++i) {
    const glm::dvec3 at = random.point();
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(at + 0.2 * random.point());
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  for (unsigned i = 0; i < 50; ++i) mesh.triangles.push_back(mesh.triangles[i]);
  return mesh;
}

/// All faces of the mesh that cross another.
std::vector<std::uint32_t> crossing_faces(const InputCrossings& crossings) {
  std::vector<std::uint32_t> faces(crossings.face_count());
  std::iota(faces.begin(), faces.end(), 0u);
  crossings.keep_crossing(faces);
  return faces;
}

// The faces are asked about so often that what each of them crosses is found once and for all.
TEST(InputCrossings, AnswersStayThoseOfSinglePairs) {
  const TriangleMesh mesh = messy(1500);
  const InputCrossings crossings({mesh.triangles, mesh.vertices}, {});
  // Some double sheets have a face on either side.
  std::vector<std::uint32_t> faces = crossing_faces(crossings), others;
  std::erase_if(faces, [&](std::uint32_t face) { return face % 7 < 3 && (others.push_back(face), true); });
  ASSERT_GT(others.size(), 200u);
  std::ranges::reverse(others);
  std::vector<std::uint32_t> expected;
  for (std::uint32_t i = 0; i < faces.size(); ++i) {
    if (std::ranges::any_of(others, [&](std::uint32_t other) { return crossings.crossed(faces[i], other); })) {
      expected.push_back(i);
    }
  }
  ASSERT_LT(expected.size(), faces.size());
  for (int time = 0; time < 5; ++time) {
    EXPECT_EQ(crossings.which_crossed(faces, others), expected);
    for (std::uint32_t i = 0; i < 20; ++i) {
      const bool any = std::ranges::binary_search(expected, i);
      EXPECT_EQ(crossings.any_crossed({&faces[i], 1}, others), any);
      EXPECT_EQ(crossings.any_crossed(others, {&faces[i], 1}), any);
    }
  }
}

TEST(InputCrossings, FacesThatAreAskedAboutOftenCostLittle) {
  const TriangleMesh mesh = messy(4000);
  const InputCrossings crossings({mesh.triangles, mesh.vertices}, {});
  const std::vector<std::uint32_t> all = crossing_faces(crossings);
  ASSERT_GT(all.size(), 3000u);
  const std::span faces(all.begin(), 1000), others(all.begin() + 1000, all.end());
  const auto ask = [&] { crossings.which_crossed(faces, others); };
  const std::size_t at_first = polls_of(ask);
  polls_of(ask);
  EXPECT_LT(polls_of(ask), at_first / 20);
}

}  // namespace
