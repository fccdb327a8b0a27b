// SPDX-License-Identifier: GPL-3.0-or-later
#include "motion/moving_faces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <span>

#include "motion/moving_crossings.h"
#include "polls.h"
#include "shapes.h"
#include "topology/crossings.h"
#include "topology/near_faces.h"

namespace {

using namespace tolvol;
using glm::dvec3;

/// A flat fan of n triangles around vertex 0, turned out of the planes of the axes, and faces with a corner of its rim
/// that do not have the hub. Faces of four corners are two of its triangles each.
struct Fan {
  auto at() const {
    return [this](std::uint32_t v) { return Box{places[v], places[v]}; };
  }
  explicit Fan(unsigned n, int corners = 3) : corners(corners) {
    places.emplace_back(0, 0, 0);
    for (unsigned i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n, y = std::sin(angle);
      places.emplace_back(std::cos(angle), 0.8 * y, 0.6 * y);
    }
    const auto rim = [&](unsigned i) { return 1 + i % n; };
    const auto step = static_cast<unsigned>(corners) - 2;
    for (unsigned i = 0; i < n; i += step) {
      faces.push_back(0);
      for (unsigned k = 0; k <= step; ++k) faces.push_back(rim(i + k));
      if (i % 16 != 0) continue;
      for (unsigned k = 0; k <= step; ++k) faces.push_back(rim(i + k));
      faces.push_back(static_cast<std::uint32_t>(places.size()));
      places.push_back(1.1 * places[rim(i)] + dvec3(0, 0, 0.1));
    }
    renew();
  }
  /// After places or faces were added.
  void renew() {
    all.resize(faces.size() / static_cast<std::size_t>(corners));
    std::iota(all.begin(), all.end(), 0u);
    near = MovingFaces(faces, static_cast<std::size_t>(corners), places.size());
    Team alone(1);
    near.build(at(), alone);
  }
  Corners triangle(std::uint32_t face, const PieceTriangle& shape = {0, 1, 2}) const {
    const std::uint32_t* const c = &faces[static_cast<std::size_t>(corners) * face];
    return {places[c[shape[0]]], places[c[shape[1]]], places[c[shape[2]]]};
  }
  std::set<std::uint32_t> found(std::uint32_t face, bool by_corners) const {
    std::set<std::uint32_t> faces;
    const auto visit = [&](std::uint32_t other) {
      EXPECT_TRUE(faces.insert(other).second) << other << " came twice";
      return true;
    };
    by_corners ? near.for_each_near(face, triangle(face), at(), visit) : near.for_each_near(face, at(), visit);
    return faces;
  }
  std::size_t found_by_all(bool by_corners) const {
    std::size_t count = 0;
    for (const std::uint32_t f : all) count += found(f, by_corners).size();
    return count;
  }
  /// The vertices for which `is_chosen` go by random ways, with all of their faces.
  template <class Chosen>
  void move(shapes::Random& random, double length, Chosen&& is_chosen) {
    std::vector<std::uint32_t> changed;
    for (std::uint32_t v = 0; v < places.size(); ++v) {
      if (!is_chosen(v)) continue;
      places[v] += length * random.point();
      for (std::size_t i = 0; i < faces.size(); ++i) {
        if (faces[i] == v) changed.push_back(static_cast<std::uint32_t>(i / static_cast<std::size_t>(corners)));
      }
    }
    if (changed.size() > 3) return near.change(changed, at());
    for (const std::uint32_t f : changed) near.change(f, at());
  }
  void expect_all_found() const {
    std::size_t crossed = 0;
    for (const std::uint32_t f : all) {
      const std::set<std::uint32_t> by_boxes = found(f, false);
      EXPECT_TRUE(by_boxes.contains(f));
      const std::set<std::uint32_t> by_corners = corners == 3 ? found(f, true) : by_boxes;
      EXPECT_TRUE(std::ranges::includes(by_boxes, by_corners));
      for (const std::uint32_t other : all) {
        if (other == f) continue;
        const auto cross = [&](const PieceTriangle& one, const PieceTriangle& another) {
          return faces_cross(triangle(f, one), triangle(other, another));
        };
        const auto shapes = triangles_of(corners);
        const bool crosses = std::ranges::any_of(shapes, [&](const PieceTriangle& one) {
          return std::ranges::any_of(shapes, [&](const PieceTriangle& another) { return cross(one, another); });
        });
        crossed += crosses;
        EXPECT_TRUE(!crosses || by_corners.contains(other)) << f << " and " << other;
      }
    }
    EXPECT_GT(crossed, 100u);
  }

  int corners;
  std::vector<dvec3> places;
  std::vector<std::uint32_t> faces, all;
  MovingFaces near;
};

TEST(MovingFaces, HaveAllThatCrossWhereverAHubAndItsRimGo) {
  for (const int corners : {3, 4}) {
    Fan fan(static_cast<unsigned>(corners - 2) * 300, corners);
    shapes::Random random(3);
    fan.move(random, 0.05, [](std::uint32_t) { return true; });
    fan.expect_all_found();
    fan.move(random, 0.2, [](std::uint32_t v) { return v == 0; });
    fan.move(random, 0.2, [](std::uint32_t v) { return v == 7; });
    fan.expect_all_found();
  }
}

// The two hubs share an edge, and faces with both are in the group of one of them.
TEST(MovingFaces, HaveAllThatCrossAtTwoHubs) {
  Fan fan(300);
  const auto other = static_cast<std::uint32_t>(fan.places.size());
  fan.places.emplace_back(0.2, 0.3, 0.1);
  for (std::uint32_t i = 1; i <= 300; ++i) fan.faces.insert(fan.faces.end(), {other, i, 1 + i % 300});
  fan.faces.insert(fan.faces.end(), {0, other, 40, other, 0, 200});
  fan.renew();
  shapes::Random random(5);
  fan.move(random, 0.05, [](std::uint32_t) { return true; });
  fan.expect_all_found();
  fan.move(random, 0.2, [&](std::uint32_t v) { return v == other || v == 7; });
  fan.expect_all_found();
}

TEST(MovingFaces, HaveAllThatCrossWhereFacesLostTheirHub) {
  Fan fan(300);
  for (std::uint32_t f = 0; f < fan.all.size(); f += 5) {
    fan.faces[3 * f] = fan.faces[3 * ((f + 90) % fan.all.size()) + 1];
    fan.near.change(f, fan.at());
  }
  shapes::Random random(4);
  fan.move(random, 0.05, [](std::uint32_t v) { return v % 2 == 0; });
  fan.expect_all_found();
}

TEST(MovingFaces, AreFewAtAHub) {
  for (const unsigned n : {1000u, 8000u}) {
    const Fan fan(n);
    EXPECT_LE(fan.found_by_all(true), 16u * n) << "without the hub's tree n^2";
    EXPECT_LE(fan.found_by_all(false), 16u * n) << "without the hub's tree n^2";
  }
}

TEST(MovingFaces, ElsewhereAreAllWithoutTheHub) {
  const Fan fan(4000);
  std::size_t looked_at = 0;
  for (const std::uint32_t f : fan.all) {
    std::set<std::uint32_t> elsewhere;
    fan.near.for_each_near_elsewhere(f, fan.at(), [&](std::uint32_t other) { return elsewhere.insert(other).second; });
    looked_at += elsewhere.size();
    const auto has_hub = [&](std::uint32_t face) {
      return std::ranges::count(std::span(fan.faces).subspan(std::size_t{3} * face, 3), 0u) > 0;
    };
    for (const std::uint32_t other : fan.found(f, false)) {
      EXPECT_EQ(elsewhere.contains(other), !(has_hub(f) && has_hub(other))) << f << " and " << other;
    }
  }
  EXPECT_LT(looked_at, fan.all.size());
}

TEST(MovingFaces, ASearchEndsWhenAVisitSaysSo) {
  const Fan fan(NearFaces::kHub);
  for (const std::uint32_t f : fan.all) {
    std::size_t visits = 0;
    fan.near.for_each_near(f, fan.at(), [&](std::uint32_t) { return ++visits < 2; });
    EXPECT_EQ(visits, 2u);
  }
}

TEST(MovingCrossings, AroundAHubAFaceIsComparedWithFew) {
  const Fan fan(4000);
  MovingCrossings crossings(fan.faces, 3, fan.places, 1);
  shapes::Random random(5);
  for (std::uint32_t v = 0; v < fan.places.size(); ++v) {
    crossings.try_at(v, (1 + 1e-3 * random.point().x) * fan.places[v] + dvec3(0.1, 0, 0));
  }
  // A face polls once for each 64 that it comes past.
  EXPECT_LT(polls_of([&] { EXPECT_TRUE(crossings.failing(fan.all, nullptr).empty()); }), fan.all.size());
}

}  // namespace
