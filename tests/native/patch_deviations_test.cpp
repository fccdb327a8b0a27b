// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/patch_deviations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "patches.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using patches::kMiddle;
using patches::Plate;

TEST(PatchDeviations, SumUpByThePowerThatIsSet) {
  Plate f(1.5);
  const PatchDeviations::State first = f.deviations.state();
  double energy = 0, largest = 0;
  for (std::size_t i = 0; i < f.deviations.terms().size(); ++i) {
    const double square = f.deviations.terms()[i].square;
    EXPECT_NEAR(f.deviations.force(i) * square, PatchDeviations::kPower * f.deviations.energy(i),
                1e-12 * f.deviations.energy(i));
    energy += f.deviations.energy(i, square);
    largest = std::max(largest, std::sqrt(square));
  }
  EXPECT_DOUBLE_EQ(first.energy, energy);
  EXPECT_DOUBLE_EQ(first.largest, largest);
  f.deviations.set_power(24);
  EXPECT_EQ(f.deviations.state().largest, first.largest);
  EXPECT_GT(f.deviations.state().energy, 10 * first.energy) << "most deviations are more than one tolerance";
  f.deviations.start(f.patch);
  EXPECT_EQ(f.deviations.power(), PatchDeviations::kPower);
}

TEST(PatchDeviations, KeepWhatIsLowerAlone) {
  Plate f(1.2);
  const PatchDeviations::State before = f.deviations.state();
  const auto lift = [&](double by) {
    for (Patch::Vertex& v : f.patch.vertices()) {
      if (v.free) v.position.z += by * f.unit;
    }
  };
  lift(0.3);
  EXPECT_FALSE(f.deviations.renew_if_lower(true));
  EXPECT_EQ(f.deviations.state().energy, before.energy);
  lift(-0.6);
  EXPECT_TRUE(f.deviations.renew_if_lower(true));
  EXPECT_NEAR(f.deviations.state().largest, 0.9, 0.02);
  EXPECT_LT(f.deviations.state().energy, before.energy);
}

TEST(PatchDeviations, IsStuckWhereAPointLiesBetweenVerticesThatDoNotMove) {
  Plate f(0);
  const auto is_fixed = [&](std::uint32_t v) { return !f.patch.vertices()[v].free; };
  const auto faces = f.patch.faces();
  const auto rim = std::ranges::find_if(faces, [&](const Patch::Face& x) {
    return is_fixed(x.corners[0]) && is_fixed(x.corners[1]) != is_fixed(x.corners[2]);
  });
  ASSERT_NE(rim, faces.end());
  const auto face = static_cast<std::uint32_t>(rim - faces.begin());
  const bool second = is_fixed(rim->corners[1]);
  const dvec3 fixed = second ? dvec3(0.5, 0.5, 0) : dvec3(0.5, 0, 0.5);
  const auto stuck = [&](const dvec3& weights, double offset) {
    f.deviations.drop_separations();
    f.deviations.add_separation(face, {weights, dvec3(0, 0, 1), offset * f.unit}, 0.05);
    f.deviations.renew();
    return f.deviations.is_stuck();
  };
  EXPECT_TRUE(stuck(fixed, 0.3));
  EXPECT_FALSE(stuck(fixed, -0.3)) << "it need not move";
  EXPECT_FALSE(stuck(dvec3(1.0 / 3), 0.3)) << "the third corner moves";
}

TEST(PatchDeviations, WhatWasBeyondBeforeMayStay) {
  Plate f(0);
  std::uint32_t face = 0;
  const dvec3 point = f.plate.mesh->position(kMiddle) + dvec3(0, 0, 0.999 * f.unit);
  f.deviations.deviation(point, face);
  const dvec3 anywhere(1.0 / 3);
  const SurfaceSample as_before{point, 1, 0.9995, anywhere};
  f.deviations.add({&as_before, 1}, face);
  f.deviations.renew();
  EXPECT_TRUE(f.deviations.enough());
  const SurfaceSample worse{point, 1, 0.9, anywhere};
  f.deviations.add({&worse, 1}, face);
  f.deviations.renew();
  EXPECT_FALSE(f.deviations.enough());
}

TEST(PatchDeviations, OnlyWhatDeviatesIsSearched) {
  Plate f(0);
  const auto searches_of = [&](const auto& call) {
    const std::size_t before = f.deviations.work();
    call();
    return f.deviations.work() - before;
  };
  const std::size_t points = f.deviations.terms().size();
  const auto move = [&](double by) {
    for (Patch::Vertex& v : f.patch.vertices()) {
      if (v.free) v.position.z += by * f.unit;
    }
  };
  EXPECT_EQ(searches_of([&] { f.deviations.renew(); }), 0u) << "nothing has moved";
  move(0.8);
  EXPECT_EQ(searches_of([&] { f.deviations.renew(); }), 0u);
  move(0.4);
  const std::size_t searched = searches_of([&] { f.deviations.renew(); });
  EXPECT_GT(searched, points / 10);
  EXPECT_LT(searched, points) << "near the rim the deviations are less than 1";
  move(-0.05);
  const std::size_t of_low_power = searches_of([&] { f.deviations.renew_if_lower(false); });
  f.deviations.set_power(24);
  move(-0.01);
  EXPECT_LT(searches_of([&] { f.deviations.renew_if_lower(false); }), of_low_power);
}

TEST(PatchDeviations, AreAtLeastTheTrueOnesAndEqualThemWhereTheyAreLarge) {
  Plate f(0.5);
  std::minstd_rand random(1);
  std::uniform_real_distribution<double> shift(-0.3, 0.3);
  for (int i = 0; i < 20; ++i) {
    for (Patch::Vertex& v : f.patch.vertices()) {
      if (v.free) v.position += f.unit * dvec3(shift(random), shift(random), 2 * shift(random));
    }
    f.deviations.renew();
    for (std::size_t t = 0; t < f.deviations.reference_count(); ++t) {
      const PatchDeviations::Term& term = f.deviations.terms()[t];
      std::uint32_t face = term.face;
      const double found = std::sqrt(term.square), exact = f.deviations.deviation(term.target, face);
      EXPECT_GE(found, exact - 1e-9);
      if (found > 1) {
        EXPECT_NEAR(found, exact, 1e-9);
      }
    }
  }
}

}  // namespace
