// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/piece_list.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "shapes.h"

namespace {

using namespace tolvol;

bool same(const Part& a, const Part& b) {
  return std::equal(a.corners, a.corners + 3, b.corners) && a.cuts == b.cuts && a.of == b.of;
}

void expect(const PieceList& list, const std::vector<Part>& pieces, const TriangleMesh& reference) {
  ASSERT_EQ(list.size(), pieces.size());
  EXPECT_EQ(list.empty(), pieces.empty());
  std::size_t parts = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    EXPECT_TRUE(same(list.at(i, reference), pieces[i])) << "piece " << i;
    if (pieces[i].cuts > 0) {
      ASSERT_LT(parts, list.parts().size());
      EXPECT_TRUE(same(list.parts()[parts++], pieces[i]));
    }
  }
  EXPECT_EQ(parts, list.parts().size());
}

TEST(PieceList, KeepsWholeTrianglesAndPartsInOrder) {
  const TriangleMesh reference = shapes::torus(10);
  std::vector<Part> halves;
  split(PieceList::whole(7, reference), halves);
  const std::vector<Part> one{PieceList::whole(3, reference), halves[0], PieceList::whole(7, reference), halves[1]};
  const std::vector<Part> other{halves[1], PieceList::whole(0, reference), halves[0]};
  PieceList list, further, whole;
  expect(list, {}, reference);
  for (const Part& piece : one) list.push_back(piece);
  for (const Part& piece : other) further.push_back(piece);
  whole.push_back(one[0]);
  expect(list, one, reference);

  std::vector<Part> all = one;
  all.insert(all.end(), other.begin(), other.end());
  list.append(further);
  expect(list, all, reference);
  list.append(whole), all.push_back(one[0]);
  expect(list, all, reference);

  whole.append(further);  // It had no part before.
  std::vector<Part> after{one[0]};
  after.insert(after.end(), other.begin(), other.end());
  expect(whole, after, reference);

  list.clear();
  expect(list, {}, reference);
  for (const Part& piece : other) list.push_back(piece);
  expect(list, other, reference);
}

// The number of one whole triangle is kept elsewhere than those of several pieces.
TEST(PieceList, OfOneWholeTriangleGrowsAndShrinks) {
  const TriangleMesh reference = shapes::torus(10);
  const Part a = PieceList::whole(3, reference), b = PieceList::whole(7, reference);
  PieceList one, empty, moved;
  one.push_back(a);
  expect(one, {a}, reference);
  EXPECT_EQ(one.parts().size(), 0u);
  empty.append(PieceList());
  expect(empty, {}, reference);
  empty.append(one);
  expect(empty, {a}, reference);
  empty.append(one);
  expect(empty, {a, a}, reference);
  one.clear();
  expect(one, {}, reference);
  one.push_back(b), one.push_back(a);
  expect(one, {b, a}, reference);
  moved = std::exchange(one, {});
  expect(one, {}, reference);
  expect(moved, {b, a}, reference);
  moved.clear();
  moved.push_back(a);
  expect(moved, {a}, reference);
}

}  // namespace
