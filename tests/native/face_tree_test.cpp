// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/face_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "shapes.h"

namespace {

using tolvol::Box;
using tolvol::FaceTree;
using tolvol::Team;
using tolvol::TriangleMesh;
using tolvol::shapes::Random;

Box random_box(Random& random) {
  Box box;
  const glm::dvec3 at = random.point();
  for (int k = 0; k < 3; ++k) box.add(at + 0.2 * random.point());
  return box;
}

std::set<std::uint32_t> found(const FaceTree& tree, const Box& box) {
  std::set<std::uint32_t> faces;
  tree.for_each_meeting(box, [&](std::uint32_t face) { EXPECT_TRUE(faces.insert(face).second); });
  return faces;
}

/// Faces are every third number, so that a number and a place are never mistaken for each other.
FaceTree tree_of(const std::vector<Box>& boxes, Team& team) {
  std::vector<std::uint32_t> faces;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) faces.push_back(3 * i);
  return FaceTree(faces, boxes, team);
}

/// The faces that are at most `apart` from a box along each axis.
std::set<std::uint32_t> among(const std::vector<Box>& boxes, Box box, double apart) {
  box.lower -= apart, box.upper += apart;
  std::set<std::uint32_t> faces;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (meet(boxes[i], box)) faces.insert(3 * i);
  }
  return faces;
}

TEST(FaceTree, FindsWhatMeetsABoxWhileFacesChangeAndVanish) {
  // Far from the origin, too, where a float32 does not tell the boxes apart.
  for (const double far : {0.0, 1e9}) {
    Random random(5);
    Team team(2);
    for (const std::size_t count : {0u, 1u, 8u, 9u, 16u, 65u, 300u, 1025u}) {
      std::vector<Box> boxes(count);
      const auto next_box = [&] {
        Box box = random_box(random);
        box.lower += far, box.upper += far;
        return box;
      };
      for (Box& box : boxes) box = next_box();
      FaceTree tree = tree_of(boxes, team);
      for (int i = 0; i < 300; ++i) {
        const Box box = next_box();
        const std::set<std::uint32_t> near = found(tree, box), wanted = among(boxes, box, 0);
        ASSERT_TRUE(std::ranges::includes(near, wanted));
        ASSERT_TRUE(std::ranges::includes(among(boxes, box, 1e-5), near));
        if (count == 0) continue;
        const std::uint32_t face = random.below(static_cast<unsigned>(count));
        boxes[face] = random.below(3) > 0 ? next_box() : Box();
        tree.change(3 * face, boxes[face]);
      }
    }
  }
}

// A float32 would not tell the boxes apart if it counted from the outlier, or without a unit that suits them.
TEST(FaceTree, FindsFewFacesBesideAnOutlierAndAtAnySize) {
  Team team(1);
  for (const double size : {1.0, 1e-200, 1e200}) {
    for (const double outlier : {0.0, -1e6, 1e6}) {
      const TriangleMesh torus = tolvol::shapes::torus(20);
      std::vector<Box> boxes;
      for (std::uint32_t t = 0; t < torus.triangles.size(); ++t) {
        boxes.emplace_back();
        for (int k = 0; k < 3; ++k) boxes.back().add(size * torus.vertices[torus.triangles[t][k]]);
      }
      boxes.push_back({glm::dvec3(size * outlier), glm::dvec3(size * outlier)});
      const FaceTree tree = tree_of(boxes, team);
      std::size_t visits = 0, meeting = 0;
      for (const Box& box : boxes) {
        visits += found(tree, box).size(), meeting += among(boxes, box, 0).size();
        tree.for_each_where([&](const Box& around) { return meet(around, box); }, [&](std::uint32_t) { ++visits; });
      }
      EXPECT_GE(visits, 2 * meeting);
      EXPECT_LE(visits, 2.2 * double(meeting)) << size << ", " << outlier;
    }
  }
}

TEST(FaceTree, EndsTheSearchWhereTheVisitSaysSo) {
  Team alone(1);
  const std::vector<Box> boxes(50, Box{glm::dvec3(0), glm::dvec3(1)});
  int visits = 0;
  tree_of(boxes, alone).for_each_meeting(boxes[0], [&](std::uint32_t) { return ++visits < 7; });
  EXPECT_EQ(visits, 7);
}

TEST(FaceTree, TouchingBoxesMeet) {
  Team alone(1);
  const FaceTree tree = tree_of({{glm::dvec3(0), glm::dvec3(1)}}, alone);
  EXPECT_EQ(found(tree, {glm::dvec3(1), glm::dvec3(2)}).size(), 1u);
  EXPECT_EQ(found(tree, {glm::dvec3(1.5), glm::dvec3(2)}).size(), 0u);
}

}  // namespace
