// SPDX-License-Identifier: GPL-3.0-or-later
// Sheets that share edges three and four at a time, or touch in a point.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <tuple>

#include "base/union_find.h"
#include "decimation_cases.h"
#include "geometry/weld.h"
#include "many.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::Options;
using cases::run;
using glm::dvec3;

/// The walls between cells^3 cubes, each wall of n x n squares. For a `seed` other than 0 about a fifth of the walls
/// are missing.
Case shelves(unsigned cells, unsigned n, std::uint32_t seed = 0) {
  TriangleMesh mesh;
  const unsigned side = cells * n;
  const auto is_missing = [&](int axis, unsigned k, unsigned i, unsigned j) {
    const unsigned wall = ((static_cast<unsigned>(axis) * (cells + 1) + k / n) * cells + i / n) * cells + j / n;
    return seed != 0 && (wall * 2654435761u + seed * 40503u) * 2246822519u % 64 < 13;
  };
  std::map<std::array<unsigned, 3>, std::uint32_t> vertex;
  const auto at = [&](int axis, unsigned k, unsigned i, unsigned j) {
    std::array<unsigned, 3> place{};
    place[axis] = k, place[(axis + 1) % 3] = i, place[(axis + 2) % 3] = j;
    const auto [entry, added] = vertex.try_emplace(place, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (added) mesh.vertices.push_back(dvec3(place[0], place[1], place[2]) / static_cast<double>(side));
    return entry->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (unsigned k = 0; k <= side; k += n) {
      for (unsigned i = 0; i < side; ++i) {
        for (unsigned j = 0; j < side; ++j) {
          if (is_missing(axis, k, i, j)) continue;
          const std::uint32_t a = at(axis, k, i, j), b = at(axis, k, i + 1, j), c = at(axis, k, i + 1, j + 1),
                              d = at(axis, k, i, j + 1);
          mesh.triangles.emplace_back(a, b, c), mesh.triangles.emplace_back(a, c, d);
        }
      }
    }
  }
  return {shapes::stored(mesh)};
}

/// Decimates with each placement and judges both results, by `judge` too. Returns how many triangles *optimal* leaves,
/// and then *subset*.
template <class Judge>
std::array<std::size_t, 2> both_placements(const Case& c, Judge&& judge) {
  std::array<std::size_t, 2> left{};
  for (const auto placement : {Options::Placement::optimal, Options::Placement::subset}) {
    Options options;
    options.placement = placement;
    const DecimationResult r = run(c, options);
    cases::expect_within(c, r);
    judge(r);
    left[placement == Options::Placement::subset] = r.triangles.size();
  }
  return left;
}

/// A row of round discs, each touching the next in one vertex.
Case beads(unsigned discs, unsigned rim) {
  TriangleMesh mesh;
  for (unsigned disc = 0; disc < discs; ++disc) {
    const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
    const std::uint32_t touched = middle - rim / 2;  // where the disc before ends
    mesh.vertices.emplace_back(2 * disc, 0, 0);
    std::vector<std::uint32_t> ring;
    for (unsigned i = 0; i < rim; ++i) {
      const double angle = std::numbers::pi * (1 + 2.0 * i / rim);
      if (i == 0 && disc > 0) {
        ring.push_back(touched);
        continue;
      }
      ring.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
      mesh.vertices.emplace_back(2 * disc + std::cos(angle), std::sin(angle), 0);
    }
    for (unsigned i = 0; i < rim; ++i) mesh.triangles.emplace_back(middle, ring[i], ring[(i + 1) % rim]);
  }
  return {shapes::stored(mesh)};
}

/// Every triangle of a grid, bent into a wave, has vertices of its own, and half of them are missing. Triangles that
/// share an edge are one sheet then, and sheets touch in points.
Case torn_wave(unsigned n) {
  TriangleMesh mesh;
  std::uint32_t random = 1;
  const auto add = [&](glm::uvec2 a, glm::uvec2 b, glm::uvec2 c) {
    random = random * 1664525 + 1013904223;
    if (random >> 31) return;
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const glm::uvec2& p : {a, b, c}) {
      const double x = p.x / static_cast<double>(n), y = p.y / static_cast<double>(n);
      mesh.vertices.emplace_back(x, y, 0.02 * std::sin(9 * x) * std::sin(7 * y));
    }
    mesh.triangles.emplace_back(first, first + 1, first + 2);
  };
  for (unsigned i = 0; i < n; ++i) {
    for (unsigned j = 0; j < n; ++j) {
      add({i, j}, {i + 1, j}, {i + 1, j + 1}), add({i, j}, {i + 1, j + 1}, {i, j + 1});
    }
  }
  return {shapes::stored(mesh)};
}

/// The number of parts of a mesh. Triangles belong together if they have an edge between the same two positions.
std::size_t parts_by_position(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> weld = weld_equal_positions(mesh.vertices);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> first_at;
  UnionFind parts(mesh.triangles.size());
  std::size_t count = mesh.triangles.size();
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = weld[mesh.triangles[t][k]], b = weld[mesh.triangles[t][(k + 1) % 3]];
      const std::uint32_t other = first_at.try_emplace(std::minmax(a, b), t).first->second;
      if (parts.find(t) != parts.find(other)) --count;
      parts.join(t, other);
    }
  }
  return count;
}

/// How many edges have so many faces, by the number of faces.
std::map<std::size_t, std::size_t> edges_by_faces(const std::vector<glm::uvec3>& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> faces;
  for (const glm::uvec3& t : triangles) {
    for (int k = 0; k < 3; ++k) ++faces[std::minmax(t[k], t[(k + 1) % 3])];
  }
  std::map<std::size_t, std::size_t> count;
  for (const auto& [edge, n] : faces) ++count[n];
  return count;
}

/// Parts that hang together by vertices.
std::size_t parts(const std::vector<glm::uvec3>& triangles, std::size_t vertices) {
  std::vector<std::uint32_t> of(vertices);
  for (std::uint32_t v = 0; v < vertices; ++v) of[v] = v;
  const auto root = [&](std::uint32_t v) {
    while (of[v] != v) v = of[v] = of[of[v]];
    return v;
  };
  for (const glm::uvec3& t : triangles) of[root(t.x)] = root(t.y), of[root(t.y)] = root(t.z);
  std::size_t count = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) count += of[v] == v;
  return count;
}

TEST(JoinedSheets, CollapseAlongTheEdgesTheyShare) {
  const Case c = shelves(2, across(8));  // 4,608 triangles, or 1,152; 72 would do
  for (const auto placement : {Options::Placement::optimal, Options::Placement::subset}) {
    Options options;
    options.placement = placement;
    const DecimationResult r = run(c, options);
    cases::expect_within(c, r);
    EXPECT_LE(r.triangles.size(), 76u);
    EXPECT_TRUE(r.locked.empty());
    const auto before = edges_by_faces(c.mesh.triangles), after = edges_by_faces(r.triangles);
    EXPECT_FALSE(after.contains(1) && !before.contains(1)) << "a sheet has come off";
    for (const auto& [faces, count] : after) {
      EXPECT_TRUE(before.contains(faces)) << faces;
      EXPECT_LE(count, before.contains(faces) ? before.at(faces) : 0);
    }
    for (std::size_t v = 0; v < r.vertices.size() && placement == Options::Placement::subset; ++v) {
      EXPECT_EQ(r.vertices[v], c.mesh.vertices[r.vertex_source[v]]);
    }
  }
}

/// Boards that share edges, some of which are missing: each wall ends as about two triangles, and no placement stalls
/// where another goes on.
TEST(JoinedSheets, BoardsWithGapsEndAsTwoTrianglesAWall) {
  for (const std::uint32_t seed : {1u, 3u}) {
    if (kSanitized && seed > 1) break;
    for (const double percent : {1.0, 0.3}) {
      Case c = shelves(kSanitized ? 2 : 3, 6, seed);
      c.percent = percent;
      const auto left = both_placements(c, [](const DecimationResult&) {});
      const double walls = static_cast<double>(c.mesh.triangles.size()) / (2 * 6 * 6);
      EXPECT_LE(static_cast<double>(left[0]), 1.02 * static_cast<double>(left[1])) << seed << " " << percent;
      EXPECT_LE(static_cast<double>(left[0]), 2.1 * walls) << seed << " " << percent;
    }
  }
}

TEST(JoinedSheets, ThreadsDoNotChangeABit) { cases::expect_same_bits(shelves(2, across(8)), {}); }

TEST(JoinedSheets, ThatTouchInAPointStayTogether) {
  const Case c = beads(4, 64);
  const DecimationResult r = run(c);
  cases::expect_within(c, r);
  EXPECT_LE(r.triangles.size(), 4 * 16u);
  EXPECT_EQ(parts(r.triangles, r.vertices.size()), 1u);
}

// Vertices at one place stay at one place, so that more of them stay than if sheets could part there.
TEST(TouchingSheets, AreNotJoinedAlongAnEdge) {
  for (const auto& [c, effort, most] : {std::tuple{torn_wave(24), Options::Effort::fast, 0.66},
                                        {torn_wave(24), Options::Effort::thorough, 0.65},
                                        {torn_wave(50), Options::Effort::fast, 0.48}}) {
    Options options;
    options.effort = effort;
    const DecimationResult r = run(c, options);
    cases::expect_within(c, r);
    EXPECT_LE(static_cast<double>(r.triangles.size()), most * static_cast<double>(c.mesh.triangles.size()));
    EXPECT_EQ(parts_by_position({r.vertices, r.triangles}), parts_by_position(c.mesh));
  }
}

/// A wall that stands on a row of a wavy floor. It has vertices of its own at the positions of that row.
Case wall_on_a_floor(unsigned n) {
  TriangleMesh floor = shapes::grid(n), wall = floor;
  for (dvec3& p : floor.vertices) p.z = 0.03 * std::sin(6 * (p.y - 0.5));
  for (dvec3& p : wall.vertices) p = {p.x, 0.5, p.y};
  return {shapes::stored(shapes::joined(floor, wall))};
}

/// Two wavy plates, of which every second border vertex is at the position of one of the other's.
Case plates_that_meet_now_and_then(unsigned n) {
  TriangleMesh left = shapes::grid(n);
  for (dvec3& p : left.vertices) p.z = 0.03 * std::sin(9 * p.y);
  TriangleMesh right = left;
  for (std::size_t v = 0; v < right.vertices.size(); ++v) {
    dvec3& p = right.vertices[v];
    p.x = 2 - p.x;
    const bool parts = p.x == 1 && std::lround(p.y * n) % 2 == 1;
    if (parts) p.x += 0.2 / n;
  }
  for (glm::uvec3& t : right.triangles) std::swap(t.y, t.z);
  return {shapes::stored(shapes::joined(left, right))};
}

/// Two spheres that touch in one vertex, each with a vertex of its own there.
Case touching_spheres() {
  TriangleMesh first = shapes::sphere(8), second = first;
  for (dvec3& p : second.vertices) p.z += 2;
  return {shapes::stored(shapes::joined(first, second))};
}

/// The positions at which both of two parts have a vertex. The first part has the first faces.
std::vector<dvec3> meeting_places(const std::vector<dvec3>& vertices, const std::vector<glm::uvec3>& triangles,
                                  const std::vector<bool>& in_first) {
  const auto order = [](const dvec3& a, const dvec3& b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); };
  std::vector<dvec3> of[2], both;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) of[in_first[t] ? 0 : 1].push_back(vertices[triangles[t][k]]);
  }
  for (auto& places : of) {
    std::sort(places.begin(), places.end(), order);
    places.erase(std::unique(places.begin(), places.end()), places.end());
  }
  std::set_intersection(of[0].begin(), of[0].end(), of[1].begin(), of[1].end(), std::back_inserter(both), order);
  return both;
}

TEST(TouchingSheets, StillMeetWhereTheyMet) {
  struct {
    const char* name;
    Case mesh;
    std::size_t least, most;  // meeting places
    double share;             // of the triangles that may be left
  } const table[] = {{"wall on a floor", wall_on_a_floor(16), 2, 17, 0.1},
                     {"plates", plates_that_meet_now_and_then(16), 9, 9, 0.15},
                     {"spheres", touching_spheres(), 1, 1, 0.3}};
  for (const auto& [name, c, least, most, share] : table) {
    for (const auto effort : {Options::Effort::fast, Options::Effort::thorough}) {
      Options options;
      options.effort = effort;
      const DecimationResult r = run(c, options);
      cases::expect_within(c, r);
      EXPECT_LE(static_cast<double>(r.triangles.size()), share * static_cast<double>(c.mesh.triangles.size())) << name;
      std::vector<bool> in_first;
      for (const std::uint32_t t : r.triangle_source) in_first.push_back(t < c.mesh.triangles.size() / 2);
      const std::vector<dvec3> places = meeting_places(r.vertices, r.triangles, in_first);
      EXPECT_GE(places.size(), least) << name;
      EXPECT_LE(places.size(), most) << name;
      // The result has no vertex in common, as the input had none.
      std::vector<int> part(r.vertices.size(), -1);
      for (std::size_t t = 0; t < r.triangles.size(); ++t) {
        for (int k = 0; k < 3; ++k) {
          int& of = part[r.triangles[t][k]];
          EXPECT_TRUE(of < 0 || of == (in_first[t] ? 0 : 1)) << name;
          of = in_first[t] ? 0 : 1;
        }
      }
    }
  }
}

/// Two boxes of bumpy sides, the second moved by `offset`, each with vertices of its own where they touch.
Case touching_boxes(unsigned n, const dvec3& offset) {
  const TriangleMesh first = shapes::box(n);
  TriangleMesh second = first;
  for (dvec3& p : second.vertices) p += offset;
  Case c{shapes::stored(shapes::joined(first, second))};
  for (dvec3& p : c.mesh.vertices) {
    p += 0.01 * dvec3(std::sin(7 * p.y + 5 * p.z), std::sin(6 * p.z + 4 * p.x), std::sin(8 * p.x + 3 * p.y));
    p = rounded_to_float32(p);
  }
  return c;
}

/// Judges results of all kinds by the places at which the two boxes meet.
template <class Judge>
void expect_boxes_to_meet(const Case& c, Judge&& judge) {
  for (const auto placement : {Options::Placement::optimal, Options::Placement::subset}) {
    for (const auto effort : {Options::Effort::fast, Options::Effort::thorough}) {
      Options options;
      options.placement = placement, options.effort = effort;
      const DecimationResult r = run(c, options);
      cases::expect_within(c, r);
      EXPECT_LE(r.triangles.size(), c.mesh.triangles.size() / 4);
      std::vector<bool> in_first;
      for (const std::uint32_t t : r.triangle_source) in_first.push_back(t < c.mesh.triangles.size() / 2);
      judge(meeting_places(r.vertices, r.triangles, in_first));
    }
  }
}

TEST(TouchingSheets, BoxesStayTogetherAlongTheEdgeInWhichTheyTouch) {
  expect_boxes_to_meet(touching_boxes(8, {1, 1, 0}), [](const std::vector<dvec3>& places) {
    ASSERT_GE(places.size(), 2u);
    const auto [lower, upper] = std::ranges::minmax(places, {}, [](const dvec3& p) { return p.z; });
    EXPECT_NEAR(upper.z - lower.z, 1, 0.05) << "the boxes have come apart at an end of the edge";
  });
}

// The faces between the boxes lie on each other, so that only those around them stay together.
TEST(TouchingSheets, StackedBoxesStayTogetherAroundTheFaceInWhichTheyTouch) {
  expect_boxes_to_meet(touching_boxes(8, {0, 0, 1}), [](const std::vector<dvec3>& places) {
    for (const dvec3& corner : {dvec3(0, 0, 1), dvec3(1, 0, 1), dvec3(0, 1, 1), dvec3(1, 1, 1)}) {
      EXPECT_TRUE(std::ranges::any_of(places, [&](const dvec3& p) { return glm::length(p - corner) < 0.05; }));
    }
  });
}

/// The wall's lowest edges lie on edges of the floor, before and after, wherever these have moved.
TEST(TouchingSheets, AWallStandsOnEdgesOfTheFloor) {
  const Case c = wall_on_a_floor(16);
  for (const auto& [placement, effort] : {std::pair{Options::Placement::optimal, Options::Effort::fast},
                                          std::pair{Options::Placement::subset, Options::Effort::fast},
                                          std::pair{Options::Placement::optimal, Options::Effort::thorough}}) {
    Options options;
    options.placement = placement, options.effort = effort;
    const DecimationResult r = run(c, options);
    using Place = std::tuple<double, double, double>;
    const auto place = [&](std::uint32_t v) { return Place(r.vertices[v].x, r.vertices[v].y, r.vertices[v].z); };
    std::set<std::pair<Place, Place>> of_floor;
    double length = 0;
    for (std::size_t t = 0; t < r.triangles.size(); ++t) {  // Those of the floor come first.
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = r.triangles[t][k], b = r.triangles[t][(k + 1) % 3];
        if (r.triangle_source[t] < c.mesh.triangles.size() / 2) {
          of_floor.insert(std::minmax(place(a), place(b)));
        } else if (std::max(r.vertices[a].z, r.vertices[b].z) < 0.1) {
          length += glm::length(r.vertices[b] - r.vertices[a]);
          EXPECT_TRUE(of_floor.contains(std::minmax(place(a), place(b)))) << "the wall has come off the floor";
        }
      }
    }
    EXPECT_NEAR(length, 1, 0.05);
  }
}

/// Three wings at a line that bends.
Case wings(unsigned n) {
  const TriangleMesh flat = shapes::grid(n);
  std::vector<TriangleMesh> all(3, flat);
  for (int wing = 0; wing < 3; ++wing) {
    const double angle = 2 * std::numbers::pi * wing / 3;
    for (dvec3& p : all[wing].vertices) {
      const double bend = 0.2 * std::sin(3 * p.y);
      p = {p.x * std::cos(angle) + bend, p.y, p.x * std::sin(angle)};
    }
  }
  TriangleMesh mesh = shapes::joined(shapes::joined(all[0], all[1]), all[2]);
  for (dvec3& p : mesh.vertices) p = rounded_to_float32(p);
  const std::vector<std::uint32_t> weld = weld_equal_positions(mesh.vertices);
  for (glm::uvec3& t : mesh.triangles) t = {weld[t.x], weld[t.y], weld[t.z]};
  return {mesh};
}

/// Along a line that bends, vertices that move leave fewer triangles than those that stay where they are.
TEST(JoinedSheets, SharedEdgesMoveWithTheirSheets) {
  Case c = wings(across(24));
  c.percent = 0.2;
  const auto left = both_placements(c, [](const DecimationResult& r) {
    EXPECT_EQ(edges_by_faces(r.triangles).size(), 3u) << "some edges are open, others have two faces or three";
    EXPECT_GE(edges_by_faces(r.triangles).at(3), 2u);
  });
  EXPECT_LE(4 * left[0], 3 * left[1]);
  cases::expect_same_bits(c, {});
}

TEST(TouchingSheets, ThreadsDoNotChangeABit) {
  cases::expect_same_bits(plates_that_meet_now_and_then(16), {});
  cases::expect_same_bits(wall_on_a_floor(16), {});
}

TEST(JoinedSheets, WhatHoldsForAVertexHoldsForItsCopies) {
  const Case c = shelves(2, 4);
  const auto locked = std::make_unique<bool[]>(c.mesh.vertices.size());
  for (std::size_t v = 0; v < c.mesh.vertices.size(); ++v) {
    locked[v] = c.mesh.vertices[v].x == 0.5 && c.mesh.vertices[v].y == 0.5;  // where four sheets meet
  }
  Options options;
  options.locked = {locked.get(), c.mesh.vertices.size()};
  const DecimationResult r = run(c, options);
  cases::expect_within(c, r);
  for (std::size_t v = 0; v < c.mesh.vertices.size(); ++v) {
    if (!locked[v]) continue;
    const std::int32_t kept = r.vertex_map[v];
    ASSERT_GE(kept, 0);
    EXPECT_EQ(r.vertices[static_cast<std::size_t>(kept)], c.mesh.vertices[v]);
    EXPECT_EQ(r.vertex_source[static_cast<std::size_t>(kept)], v);
  }
}

/// Two wavy plates that lie on each other and look in opposite directions, each with vertices of its own.
Case double_sheet(unsigned n) {
  TriangleMesh front = shapes::grid(n);
  for (dvec3& p : front.vertices) p.z = 0.05 * std::sin(9 * p.x) * std::sin(7 * p.y);
  Case c{shapes::stored(shapes::joined(front, shapes::turned(front)))};
  c.percent = 0.1;
  return c;
}

// A flip that is found possible must still be so after the collapse and the other flips of its patch.
TEST(JoinedSheets, ThoroughKeepsTheToleranceAndWhatIsLocked) {
  for (const Case& c :
       {shelves(2, across(6), 1), wall_on_a_floor(across(12)), double_sheet(across(14)), torn_wave(across(14))}) {
    const auto locked = std::make_unique<bool[]>(c.mesh.vertices.size());
    for (std::size_t v = 0; v < c.mesh.vertices.size(); ++v) locked[v] = v % 17 == 0;
    Options options;
    options.effort = Options::Effort::thorough;
    options.locked = {locked.get(), c.mesh.vertices.size()};
    const DecimationResult r = run(c, options);
    cases::expect_within(c, r);
    for (std::size_t v = 0; v < c.mesh.vertices.size(); ++v) {
      if (!locked[v] || r.vertex_map[v] < 0) continue;
      EXPECT_EQ(r.vertices[static_cast<std::size_t>(r.vertex_map[v])], c.mesh.vertices[v]);
    }
    for (const glm::uvec3& t : r.triangles) EXPECT_TRUE(t.x != t.y && t.y != t.z && t.z != t.x);
  }
}

TEST(JoinedSheets, OneWayTheirSharedEdgesStay) {
  const Case c = shelves(2, 4);
  Options options;
  options.two_sided = false;
  const DecimationResult r = run(c, options);
  cases::expect_within(c, r, false);
}

}  // namespace
