// SPDX-License-Identifier: GPL-3.0-or-later
// Judged by exact predicates alone (faces_cross_exactly()), and by distances of points of both triangles.
#include "topology/faces_apart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

constexpr double kFar = std::numeric_limits<double>::infinity();
const Corners kFlat{dvec3(0, 0, 0), dvec3(4, 0, 0), dvec3(0, 4, 0)};

Corners random_corners(shapes::Random& random) { return {random.point(), random.point(), random.point()}; }

dvec3 random_point(const Corners& t, shapes::Random& random) {
  double u = random.share(), v = random.share();
  if (u + v > 1) u = 1 - u, v = 1 - v;
  return t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
}

TEST(FacesApart, TheGapOfParallelTrianglesIsTheirDistance) {
  const Corners above{dvec3(0, 0, 0.5), dvec3(4, 0, 0.5), dvec3(0, 4, 0.5)};
  EXPECT_NEAR(gap(kFlat, above, kFar), 0.5, 1e-12);
  EXPECT_LE(gap(kFlat, above, kFar), 0.5);
  const Corners beside{dvec3(-1, 0, 0), dvec3(-2, 3, 0), dvec3(-1, 3, 0)};
  EXPECT_NEAR(gap(kFlat, beside, kFar), 1, 1e-12);
  EXPECT_EQ(gap(kFlat, {dvec3(1, 1, -1), dvec3(1, 1, 1), dvec3(9, 9, 0)}, kFar), 0);
}

TEST(FacesApart, TheGapIsNeverLargerThanTheDistanceOfTwoPoints) {
  shapes::Random random(3);
  std::size_t found = 0;
  for (int i = 0; i < 2'000; ++i) {
    const Corners a = random_corners(random);
    Corners b = random_corners(random);
    for (dvec3& corner : b) corner += 2.0 * dvec3(random.share(), random.share(), random.share());
    const double apart = gap(a, b, kFar), enough = gap(a, b, 0.1);
    EXPECT_EQ(apart >= 0.1, enough >= 0.1);
    EXPECT_LE(enough, apart);
    if (apart == 0) continue;
    ++found;
    EXPECT_FALSE(faces_cross_exactly(a, b));
    for (int k = 0; k < 50; ++k) {
      ASSERT_LE(apart, glm::length(random_point(a, random) - random_point(b, random)) * (1 + 1e-12));
    }
  }
  EXPECT_GT(found, 500u);
}

TEST(FacesApart, WhatIsSaidToBeUncrossedIsUncrossed) {
  // Corners on a small grid share places, lie on each other's edges and in each other's planes.
  shapes::Random random(5);
  std::size_t sure[4] = {}, all[4] = {};
  for (int i = 0; i < 100'000; ++i) {
    const auto corner = [&] { return dvec3(random.below(4), random.below(4), random.below(2)) * 0.1; };
    Corners a{corner(), corner(), corner()}, b{corner(), corner(), corner()};
    int shared = 0;
    for (const dvec3& p : a) shared += std::ranges::find(b, p) != b.end();
    const bool cross = faces_cross_exactly(a, b), uncrossed = surely_uncrossed(a, b);
    ASSERT_FALSE(cross && uncrossed);
    ASSERT_EQ(uncrossed, surely_uncrossed(a, b));
    if (is_degenerate(a) || is_degenerate(b) || cross) continue;
    ++all[shared], sure[shared] += uncrossed;
  }
  for (int shared = 0; shared < 3; ++shared) {
    EXPECT_GT(all[shared], 1'000u) << shared;
    EXPECT_GT(sure[shared], all[shared] / 3) << shared;
  }
}

TEST(FacesApart, NothingIsSureWhereRoundingDecides) {
  // The corner is a part in 10^17 above the plane, or below it.
  for (const double height : {1e-17, -1e-17, 0.0}) {
    const Corners touching{dvec3(1, 1, height), dvec3(1, 2, 3), dvec3(2, 1, 3)};
    EXPECT_FALSE(surely_uncrossed(
        {dvec3(0.1, 0.2, 0.3) + kFlat[0], dvec3(0.1, 0.2, 0.3) + kFlat[1], dvec3(0.1, 0.2, 0.3) + kFlat[2]},
        {dvec3(0.1, 0.2, 0.3) + touching[0], dvec3(0.1, 0.2, 0.3) + touching[1], dvec3(0.1, 0.2, 0.3) + touching[2]}));
  }
  const double huge = 1e200;
  EXPECT_FALSE(surely_uncrossed({dvec3(0), dvec3(huge, 0, 0), dvec3(0, huge, 0)},
                                {dvec3(0, 0, 1), dvec3(huge, 0, 1), dvec3(0, huge, 1)}))
      << "products overflow";
}

TEST(FacesApart, NeighboursOnAFlatSurfaceAreToldApartWithoutExactArithmetic) {
  const TriangleMesh mesh = shapes::sphere(12);
  std::size_t pairs = 0, sure = 0;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::uint32_t k = 0; k < i; ++k) {
      const MeshView view{mesh.triangles, mesh.vertices};
      if (!meet(box_of(view.corners(i)), box_of(view.corners(k)))) continue;
      ++pairs, sure += surely_uncrossed(view.corners(i), view.corners(k));
    }
  }
  EXPECT_GT(sure, pairs * 95 / 100);
}

// The boxes of long segments and needles meet those of very many faces.
TEST(FacesApart, ASegmentAndATriangleBesideItAreToldApartWithoutExactArithmetic) {
  shapes::Random random(7);
  for (const double width : {0.0, 1e-3}) {
    std::size_t pairs = 0, sure = 0;
    for (int i = 0; i < 20'000; ++i) {
      const dvec3 end = random.point(), other = random.point(), place = random.point();
      const Corners needle{end, other, other + width * random.point()};
      const Corners triangle{place, place + 0.1 * random.point(), place + 0.1 * random.point()};
      if (!meet(box_of(needle), box_of(triangle)) || faces_cross(needle, triangle)) continue;
      ++pairs, sure += surely_uncrossed(needle, triangle);
    }
    EXPECT_GT(pairs, 1'000u);
    EXPECT_GT(sure, pairs * 97 / 100) << width << ": " << sure << " of " << pairs;
  }
}

TEST(FacesApart, WhatIsApartFromAFanCrossesNoFaceOfIt) {
  shapes::Random random(5);
  std::size_t apart = 0, seen = 0, cross = 0;
  for (int i = 0; i < 20'000; ++i) {
    const bool is_flat = i % 2 == 0, shares_hub = i % 3 == 0, shares_rim = i % 5 == 0;
    const auto point = [&] {
      const dvec3 p = random.point();
      return is_flat ? dvec3(p.x, p.y, 0) : p;
    };
    const dvec3 hub = point(), middle = point();
    const double size = i % 7 == 0 ? 1 : 0.2;
    const auto on_rim = [&] { return middle + size * (point() - middle); };
    Corners own{point(), point(), point()};
    const Corners face{hub, on_rim(), on_rim()}, strayed{on_rim(), on_rim(), on_rim()};
    Box rims, directions = directions_of(face, hub);
    for (const dvec3& p : {face[1], face[2], strayed[0], strayed[1], strayed[2]}) rims.add(p);
    directions.add(directions_of(strayed, hub));
    if (shares_hub) own[static_cast<std::size_t>(i) % 9 / 3] = hub;
    if (shares_rim) own[static_cast<std::size_t>(i) % 9 / 3 == 0 ? 1 : 0] = face[1];
    const bool crosses = faces_cross(own, face) || faces_cross(own, strayed);
    cross += crosses;
    const ApartFromFan from_fan(own, hub);
    if (from_fan.looks_by_directions() && from_fan.surely_seen(directions)) {
      ++seen;
      EXPECT_FALSE(crosses) << i;
    }
    if (!from_fan.surely(rims)) continue;
    ++apart;
    EXPECT_FALSE(crosses) << i;
  }
  EXPECT_GT(apart, 3000u);
  EXPECT_GT(seen, 1000u);
  EXPECT_GT(cross, 3000u);
}

TEST(FacesApart, SliversBesideEachOtherAreApartSeenFromTheirHub) {
  // They all run from one place of a line to the hub. Some of them share an edge with the one that is looked at.
  const dvec3 hub(1, 0.3, 0.2);
  constexpr int kCount = 1000;
  const auto on_line = [](int i) { return dvec3(double(i) / kCount, 0.001, 0); };
  for (const int own : {3, 400, 998}) {
    const ApartFromFan apart({on_line(own), on_line(own + 1), hub}, hub);
    for (int i = 0; i < kCount; ++i) {
      Box rim;
      rim.add(on_line(i)), rim.add(on_line(i + 1));
      EXPECT_EQ(apart.surely(rim), std::abs(i - own) > 1) << i;
    }
    Box after;
    after.add(on_line(own + 2)), after.add(on_line(kCount));
    EXPECT_EQ(apart.surely(after), own + 2 <= kCount);
  }
}

TEST(FacesApart, WhatHasNoDirectionIsNotSoughtByDirections) {
  const dvec3 hub(0), p(1, 0.5, 0.2), q(0.3, 1, 0.1);
  EXPECT_TRUE(ApartFromFan({hub, p, q}, hub).looks_by_directions());
  for (const Corners& own :
       {Corners{hub, p, p}, Corners{hub, p, 2.0 * p}, Corners{hub, hub, p}, Corners{hub, hub, hub}}) {
    EXPECT_FALSE(ApartFromFan(own, hub).looks_by_directions()) << "all of the crowd would be looked at";
  }
}

TEST(FacesApart, WhatCrossesIsNeverSurelyUncrossedAtAnySize) {
  // Across needles some products are too large for double precision from 1e76 on, and some squares too small before.
  shapes::Random random(7);
  std::size_t crossing = 0;
  for (int i = 0; i < 60'000; ++i) {
    const double size = std::pow(10, (i % 2 ? 1 : -1) * (60 + 40 * random.share()));
    const auto needle = [&] {
      const dvec3 start = random.point();
      return Corners{size * start, size * (start + 2.0 * random.point()), size * (start + 0.2 * random.point())};
    };
    const Corners a = needle(), b = needle();
    if (!faces_cross_exactly(a, b)) continue;
    ++crossing;
    ASSERT_FALSE(surely_uncrossed(a, b)) << size;
    ASSERT_EQ(gap(a, b, kFar), 0) << size;
  }
  EXPECT_GT(crossing, 500u);
}

TEST(FacesApart, TinyEdgesAreNotTakenForSureBesideHugeOnes) {
  // The products of the tiny edges are too small for double precision. The huge corner lies in the plane of all.
  shapes::Random random(9);
  const double tiny = 0x1p-540, huge = 0x1p280;
  std::size_t crossing = 0;
  for (int i = 0; i < 2'000; ++i) {
    const auto whole = [&] { return dvec3(random.below(12), random.below(12), random.below(12)) - dvec3(6); };
    const dvec3 u = whole(), v = whole();
    const auto in_plane = [&] { return huge * (double(random.below(5) + 1) * v + (double(random.below(9)) - 4) * u); };
    const Corners a{dvec3(0), tiny * u, tiny * v};
    for (const Corners& b : {Corners{dvec3(0), tiny * u, in_plane()}, Corners{dvec3(0), in_plane(), in_plane()}}) {
      if (!faces_cross_exactly(a, b)) continue;
      ++crossing;
      ASSERT_FALSE(surely_uncrossed(a, b) || surely_uncrossed(b, a)) << i;
    }
  }
  EXPECT_GT(crossing, 1'000u);
}

TEST(FacesApart, TheGapGrowsWithTheSize) {
  const Corners above{dvec3(0, 0, 0.5), dvec3(4, 0, 0.5), dvec3(0, 4, 0.5)};
  for (const double size : {1e-90, 1e-80, 1e-70, 1e-30, 1e30, 1e70}) {
    Corners one = kFlat, other = above;
    for (dvec3& p : one) p *= size;
    for (dvec3& p : other) p *= size;
    const double apart = gap(one, other, kFar);
    EXPECT_LE(apart, 0.5 * size * (1 + 1e-12));
    if (size > 1e-80) {
      EXPECT_NEAR(apart / size, 0.5, 1e-9) << size;
    }
  }
}

TEST(FacesApart, CoordinatesOfAnySizeAreHandled) {
  for (const double scale : {1e-150, 1e-20, 1.0, 1e20, 1e150}) {
    const Corners own{scale * dvec3(0, 0, 0), scale * dvec3(1, 0, 0), scale * dvec3(0, 1, 0)};
    Box through, beside;
    through.add(scale * dvec3(0.2, 0.2, -1)), through.add(scale * dvec3(0.3, 0.3, 1));
    beside.add(scale * dvec3(0.9, 0.9, -1)), beside.add(scale * dvec3(0.95, 0.95, 1));
    const ApartFromFan apart(own, scale * dvec3(0.8, 0.8, 0));
    EXPECT_FALSE(apart.surely(through)) << scale;
    if (scale == 1) {
      EXPECT_TRUE(apart.surely(beside));
    }
  }
}

}  // namespace
