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

std::set<std::uint32_t> among(const std::vector<Box>& boxes, const Box& box) {
  std::set<std::uint32_t> faces;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (meet(boxes[i], box)) faces.insert(3 * i);
  }
  return faces;
}

TEST(FaceTree, FindsWhatMeetsABoxWhileFacesChangeAndVanish) {
  Random random(5);
  Team team(2);
  for (const std::size_t count : {0u, 1u, 8u, 9u, 16u, 65u, 300u, 1025u}) {
    std::vector<Box> boxes(count);
    for (Box& box : boxes) box = random_box(random);
    FaceTree tree = tree_of(boxes, team);
    for (int i = 0; i < 300; ++i) {
      const Box box = random_box(random);
      ASSERT_EQ(found(tree, box), among(boxes, box));
      if (count == 0) continue;
      const std::uint32_t face = random.below(static_cast<unsigned>(count));
      boxes[face] = random.below(3) > 0 ? random_box(random) : Box();
      tree.change(3 * face, boxes[face]);
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

TEST(FaceTree, GivesEachPairOfFacesThatMeetOnce) {
  Team team(2);
  Random random(5);
  std::size_t total = 0;
  for (const std::size_t count : {1u, 7u, 8u, 9u, 64u, 65u, 500u}) {
    std::vector<Box> boxes;
    while (boxes.size() < count) boxes.push_back(random_box(random));
    FaceTree tree = tree_of(boxes, team);
    for (const bool changed : {false, true}) {
      if (changed) {
        boxes[count / 2] = random_box(random), boxes[0] = Box();
        tree.change(static_cast<std::uint32_t>(3 * (count / 2)), boxes[count / 2]);
        tree.change(0, boxes[0]);
      }
      std::multiset<std::pair<std::uint32_t, std::uint32_t>> pairs, expected;
      for (std::size_t leaf = 0; leaf < tree.leaf_count(); ++leaf) {
        tree.for_each_pair(leaf, [&](std::uint32_t a, std::uint32_t b) {
          pairs.insert(std::minmax(a, b));
          return true;
        });
      }
      for (std::uint32_t i = 0; i < count; ++i) {
        for (std::uint32_t k = i + 1; k < count; ++k) {
          if (meet(boxes[i], boxes[k])) expected.emplace(3 * i, 3 * k);
        }
      }
      EXPECT_EQ(pairs, expected) << count;
      total += pairs.size();
    }
  }
  EXPECT_GT(total, 1000u);
  EXPECT_EQ(FaceTree().leaf_count(), 0u);
}

}  // namespace
