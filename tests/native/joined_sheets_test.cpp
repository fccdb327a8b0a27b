// SPDX-License-Identifier: GPL-3.0-or-later
// Sheets that share edges three and four at a time, or touch in a point.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>

#include "decimation_cases.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::Options;
using cases::run;
using glm::dvec3;

/// The walls between cells^3 cubes, each wall of n x n squares.
Case shelves(unsigned cells, unsigned n) {
  TriangleMesh mesh;
  const unsigned side = cells * n;
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
          const std::uint32_t a = at(axis, k, i, j), b = at(axis, k, i + 1, j), c = at(axis, k, i + 1, j + 1),
                              d = at(axis, k, i, j + 1);
          mesh.triangles.emplace_back(a, b, c), mesh.triangles.emplace_back(a, c, d);
        }
      }
    }
  }
  return {shapes::stored(mesh)};
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
  const Case c = shelves(2, 8);  // 4,608 triangles; 72 would do
  for (const auto placement : {Options::Placement::optimal, Options::Placement::subset}) {
    Options options;
    options.placement = placement;
    const DecimationResult r = run(c, options);
    cases::expect_within(c, r);
    EXPECT_LE(r.triangles.size(), 200u);
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

TEST(JoinedSheets, ThreadsDoNotChangeABit) { cases::expect_same_bits(shelves(2, 8), {}); }

TEST(JoinedSheets, ThatTouchInAPointStayTogether) {
  const Case c = beads(4, 64);
  const DecimationResult r = run(c);
  cases::expect_within(c, r);
  EXPECT_LE(r.triangles.size(), 4 * 16u);
  EXPECT_EQ(parts(r.triangles, r.vertices.size()), 1u);
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

TEST(JoinedSheets, OneWayTheirSharedEdgesStay) {
  const Case c = shelves(2, 4);
  Options options;
  options.two_sided = false;
  const DecimationResult r = run(c, options);
  cases::expect_within(c, r, false);
}

}  // namespace
