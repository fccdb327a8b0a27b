// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/succession.h"

#include <gtest/gtest.h>

#include <numeric>

#include "topology/face_origins.h"

namespace {

using tolvol::FaceOrigins;
using tolvol::Succession;
using Owners = std::vector<std::uint32_t>;

TEST(Succession, LeavesEveryMemberWithItsOwnerWhereThatServes) {
  Succession s({0, 1, 1, Succession::kOutside});
  s.need(0, {0, 1}), s.need(1, {1, 2});
  EXPECT_EQ(s.find(), (Owners{0, 1, 1, Succession::kOutside}));
}

TEST(Succession, GivesAMemberToTheFaceThatNeedsIt) {
  Succession s({0, 0, 0});
  s.need(1, {0, 1, 2}), s.need(2, {1});
  const auto found = s.find();
  ASSERT_TRUE(found);
  EXPECT_EQ((*found)[1], 2u) << "the need that only one member meets chooses first";
  EXPECT_TRUE((*found)[0] == 1 || (*found)[2] == 1);
}

TEST(Succession, OneMemberMeetsSeveralNeedsOfItsFace) {
  Succession s({0, Succession::kOutside});
  s.need(0, {0}), s.need(0, {0}), s.need(1, {1});
  EXPECT_EQ(s.find(), (Owners{0, 1}));
}

TEST(Succession, FindsNothingWhereTwoFacesNeedOneMember) {
  Succession s({0});
  s.need(0, {0}), s.need(1, {0});
  EXPECT_FALSE(s.find());
  Succession none({0});
  none.need(0, {});
  EXPECT_FALSE(none.find());
}

TEST(Succession, WhatIsKeptIsNotGiven) {
  Succession s({0});
  s.keep(0);
  s.need(1, {0});
  EXPECT_FALSE(s.find());
}

Owners of(const FaceOrigins& origins, std::uint32_t face) {
  Owners found;
  origins.for_each(face, [&](std::uint32_t i) {
    found.push_back(i);
    return true;
  });
  return found;
}

TEST(FaceOrigins, AreHandedOverAndGiven) {
  FaceOrigins origins(5);
  origins.hand_over(1, 0), origins.hand_over(2, 0);
  EXPECT_EQ(of(origins, 0), (Owners{0, 1, 2}));
  origins.give(0, 0, 3);  // the first, the last and the only one of a list
  origins.give(2, 0, 3);
  origins.give(4, 4, 3);
  EXPECT_EQ(of(origins, 0), Owners{1});
  EXPECT_EQ(of(origins, 3), (Owners{3, 0, 2, 4}));
  EXPECT_TRUE(of(origins, 4).empty());
  const std::uint32_t empty = origins.state(4), full = origins.state(3);
  origins.hand_over(0, 3);  // a face that stands for itself no more
  origins.hand_over(3, 4);
  EXPECT_EQ(of(origins, 4).size(), 5u);
  origins.restore(4, empty), origins.restore(3, full);
  EXPECT_TRUE(of(origins, 4).empty());
  EXPECT_EQ(of(origins, 3), (Owners{3, 0, 2, 4}));
}

}  // namespace
