// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/input_crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <span>

#include "base/parallel.h"
#include "polls.h"
#include "shapes.h"

namespace {

using glm::dvec3;
using tolvol::InputCrossings;
using tolvol::polls_of;
using tolvol::TriangleMesh;

/// Small triangles at random places, of which some cross a few others. The first ones are there twice, on the same
/// positions, so that they are double sheets.
TriangleMesh messy(unsigned count) {
  TriangleMesh mesh;
  tolvol::shapes::Random random(7);
  for (unsigned i = 0; i < count; ++i) {
    const dvec3 at = random.point();
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
  ASSERT_GE(others.size(), 256u);  // after four times, lists are made
  std::ranges::reverse(others);
  std::vector<std::uint32_t> expected;
  for (std::uint32_t i = 0; i < faces.size(); ++i) {
    if (std::ranges::any_of(others, [&](std::uint32_t other) { return crossings.crossed(faces[i], other); })) {
      expected.push_back(i);
    }
  }
  ASSERT_TRUE(!expected.empty() && expected.size() < faces.size());
  for (int time = 0; time < 5; ++time) {
    EXPECT_EQ(crossings.which_crossed(faces, others), expected);
    for (std::uint32_t i = 0; i < 20; ++i) {
      const bool any = std::ranges::binary_search(expected, i);
      EXPECT_EQ(crossings.any_crossed({&faces[i], 1}, others), any);
      EXPECT_EQ(crossings.any_crossed(others, {&faces[i], 1}), any);
    }
  }
  // Lists are now longer than what is asked about.
  for (std::uint32_t k = 0; k < 20; ++k) {
    for (const std::uint32_t i : crossings.which_crossed(faces, {&others[k], 1})) {
      EXPECT_TRUE(crossings.crossed(faces[i], others[k]));
    }
    const auto one = [&](std::uint32_t face) { return crossings.crossed(face, others[k]); };
    EXPECT_EQ(crossings.which_crossed(faces, {&others[k], 1}).size(), std::size_t(std::ranges::count_if(faces, one)));
  }
}

TEST(InputCrossings, ThreadsGetTheAnswersOfOne) {
  const TriangleMesh mesh = messy(3000);
  const InputCrossings alone({mesh.triangles, mesh.vertices}, {}), shared({mesh.triangles, mesh.vertices}, {});
  const std::vector<std::uint32_t> all = crossing_faces(alone);
  const std::span faces(all.begin(), all.size() / 2), others(all.begin() + all.size() / 2, all.end());
  const std::vector<std::uint32_t> expected = alone.which_crossed(faces, others);
  std::vector<std::vector<std::uint32_t>> found(16);
  tolvol::Team team(4);
  team.run(found.size(), 1, [&](std::size_t i, std::size_t) {
    std::vector<std::uint32_t> kept(faces.begin(), faces.end()), met(others.begin(), others.end());
    shared.keep_crossing(kept), shared.keep_crossing(met);
    found[i] = shared.which_crossed(kept, met);
  });
  for (const auto& one : found) EXPECT_EQ(one, expected);
}

// Each face crosses the first that it is asked about, so that no search is long.
TEST(InputCrossings, ManyShortSearchesPoll) {
  TriangleMesh mesh;
  for (const dvec3& p : {dvec3(-9, -9, 0), dvec3(9, -9, 0), dvec3(0, 9, 0)}) mesh.vertices.push_back(p);
  mesh.triangles.emplace_back(0, 1, 2);
  std::vector<std::uint32_t> faces;
  for (unsigned i = 1; i <= 20'000; ++i) {
    const double x = 1e-4 * i;
    for (const dvec3& p : {dvec3(x, 0, -1), dvec3(x, 0, 1), dvec3(x, 1e-3, 1)}) mesh.vertices.push_back(p);
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    faces.push_back(i);
  }
  const InputCrossings crossings({mesh.triangles, mesh.vertices}, {});
  const std::uint32_t plane[] = {0};
  crossings.keep_crossing(faces);
  EXPECT_EQ(crossings.which_crossed(faces, plane).size(), 20'000u);
  EXPECT_GT(polls_of([&] { crossings.which_crossed(faces, plane); }), 3u);
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
