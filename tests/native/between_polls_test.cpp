// SPDX-License-Identifier: GPL-3.0-or-later
/// How much work there is between two polls of a search that has to look at very much, so that a call ends soon after
/// it was cancelled.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "field/display_tree.h"
#include "polls.h"
#include "shapes.h"
#include "topology/crossings.h"
#include "topology/face_tree.h"
#include "topology/wedges.h"

namespace {

using namespace tolvol;

// From the middle of a sphere all of its triangles are about as near.
TEST(BetweenPolls, OneDistanceInADisplayTree) {
  const TriangleMesh sphere = shapes::sphere(100);
  const DisplayTree tree(sphere, false);
  std::size_t polls = polls_of([&] { tree.distance(glm::dvec3(0), 2); });
  EXPECT_GE(polls, tree.nodes.size() / 4096) << "of " << tree.nodes.size() << " nodes";
  const Counted cancelled(2);
  EXPECT_THROW(tree.distance(glm::dvec3(0), 2), Cancelled);
}

// Each face is near all others, and none of the numbers of the faces is one at which a loop over all faces would poll.
TEST(BetweenPolls, FacesThatAllCross) {
  const unsigned n = 1000;
  TriangleMesh mesh;
  mesh.vertices = {{9, 0, 0}, {9, 1, 0}, {9, 0, 1}};
  mesh.triangles = {{0, 1, 2}};
  for (unsigned i = 0; i < n; ++i) {
    const double angle = std::numbers::pi * i / n;
    const glm::dvec3 out(std::cos(angle), std::sin(angle), 0);
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const glm::dvec3& p : {out, -out, glm::dvec3(0, 0, 1 + 0.001 * i)}) mesh.vertices.push_back(p);
    mesh.triangles.push_back(first + glm::uvec3(0, 1, 2));
  }
  Team team(1);
  Crossings found;
  const std::size_t polls =
      polls_of([&] { found = crossings(mesh.vertices, mesh.triangles, std::size_t{1} << 30, team, nullptr); });
  EXPECT_EQ(found.pairs.size(), n * (n - 1) / 2);
  EXPECT_GE(polls, n * n / 512u);
}

TEST(BetweenPolls, ATreeOfFaces) {
  const unsigned n = 400000;
  shapes::Random random(3);
  std::vector<std::uint32_t> faces(n);
  std::iota(faces.begin(), faces.end(), 0u);
  std::vector<Box> boxes(n);
  for (Box& box : boxes) box.add(random.point());
  Team team(1);
  // There is a poll for each node that is cut in two, and further ones while the faces, the leaves and the nodes above
  // them are written.
  const std::size_t leaves = std::bit_ceil(n / 8u);
  EXPECT_GE(polls_of([&] { FaceTree(faces, boxes, team); }), leaves - 1 + n / 4096 + 2 * (leaves / 4096));
}

TEST(BetweenPolls, IslandsOfWedges) {
  const TriangleMesh mesh = shapes::grid(200);
  const std::size_t sides = 3 * mesh.triangles.size();
  std::vector<std::uint32_t> labels;
  const std::size_t polls = polls_of([&] { labels = island_labels(mesh.triangles, mesh.triangles); });
  EXPECT_GE(polls, 10 * sides / 4096) << "a sort compares each side more than ten times";
  EXPECT_EQ(std::ranges::count(labels, labels.front()), std::ptrdiff_t(labels.size()));
}

}  // namespace
