// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/solidity.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "many.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

Solidity of(const TriangleMesh& mesh, unsigned threads = 1) {
  Team team(threads);
  return solidity(mesh.vertices, mesh.triangles, team);
}

TriangleMesh without(TriangleMesh mesh, std::size_t triangle) {
  mesh.triangles.erase(mesh.triangles.begin() + std::ptrdiff_t(triangle));
  return mesh;
}

TEST(Solidity, ClosedSurfacesBoundASolid) {
  for (const TriangleMesh& mesh :
       {shapes::box(3), shapes::torus(12), shapes::soup(shapes::box(3)), shapes::turned(shapes::torus(12))}) {
    const Solidity found = of(mesh);
    EXPECT_TRUE(found.closed() && found.manifold() && found.oriented());
    EXPECT_EQ(found.shells, 1u);
  }
  EXPECT_EQ(of(shapes::joined(shapes::box(2), shapes::torus(12))).shells, 2u);
  const Solidity nothing = of({});
  EXPECT_FALSE(nothing.closed());
  EXPECT_EQ(nothing.shells, 0u);
}

TEST(Solidity, EveryHoleIsOneLoop) {
  const Solidity sheet = of(shapes::grid(4)), holed = of(without(without(shapes::torus(20), 500), 3));
  EXPECT_EQ(sheet.boundary_loops, 1u);
  EXPECT_EQ(sheet.open_edges, 16u);
  EXPECT_EQ(holed.boundary_loops, 2u);
  EXPECT_EQ(holed.open_edges, 6u);
  EXPECT_TRUE(holed.manifold() && holed.oriented() && !holed.closed());
}

TEST(Solidity, ATurnedFaceAndADegenerateOneAreCounted) {
  TriangleMesh mesh = shapes::box(2);
  std::swap(mesh.triangles[5].y, mesh.triangles[5].z);
  mesh.vertices.push_back(mesh.vertices[0]);
  mesh.triangles.emplace_back(0, 7, unsigned(mesh.vertices.size()) - 1);
  const Solidity found = of(mesh);
  EXPECT_EQ(found.misoriented_edges, 3u);
  EXPECT_EQ(found.degenerate_triangles, 1u);
  EXPECT_TRUE(found.closed() && found.manifold());
}

TEST(Solidity, PositiveAndNegativeZeroAreOnePosition) {
  TriangleMesh mesh = shapes::soup(shapes::box(1));
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 2) {
    for (int k = 0; k < 3; ++k) {
      if (mesh.vertices[i][k] == 0) mesh.vertices[i][k] = -0.0;
    }
  }
  EXPECT_TRUE(of(mesh).closed());
}

/// The same by sets, for triangles that are not degenerate.
Solidity by_sets(const TriangleMesh& mesh) {
  using Place = std::array<double, 3>;
  const auto place = [&](std::uint32_t v) {
    const dvec3 p = mesh.vertices[v] + 0.0;
    return Place{p.x, p.y, p.z};
  };
  std::map<std::pair<Place, Place>, std::vector<std::pair<std::size_t, bool>>> edges;  // triangle, runs upwards
  std::map<Place, std::set<std::size_t>> around;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Place a = place(mesh.triangles[i][k]), b = place(mesh.triangles[i][(k + 1) % 3]);
      edges[std::minmax(a, b)].emplace_back(i, a < b);
      around[a].insert(i);
    }
  }
  /// The number of groups of things that neighbours() connects.
  const auto groups = [](auto things, auto&& neighbours) {
    std::size_t count = 0;
    for (; !things.empty(); ++count) {
      auto queue = std::vector{*things.begin()};
      things.erase(things.begin());
      while (!queue.empty()) {
        const auto thing = queue.back();
        queue.pop_back();
        for (const auto& other : neighbours(thing)) {
          if (things.erase(other)) queue.push_back(other);
        }
      }
    }
    return count;
  };
  Solidity found;
  std::map<Place, std::vector<Place>> open;
  std::set<Place> open_places;
  std::map<std::size_t, std::vector<std::pair<std::size_t, std::pair<Place, Place>>>> beside;
  for (const auto& [edge, sides] : edges) {
    if (sides.size() == 1) {
      ++found.open_edges;
      open[edge.first].push_back(edge.second), open[edge.second].push_back(edge.first);
      open_places.insert({edge.first, edge.second});
    }
    found.non_manifold_edges += sides.size() > 2;
    found.misoriented_edges += sides.size() == 2 && sides[0].second == sides[1].second;
    for (const auto& a : sides) {
      for (const auto& b : sides) beside[a.first].emplace_back(b.first, edge);
    }
  }
  found.boundary_loops = groups(open_places, [&](const Place& p) { return open[p]; });
  for (const auto& [at, triangles] : around) {
    const Place& here = at;
    found.non_manifold_vertices += groups(triangles, [&](std::size_t t) {
                                     std::vector<std::size_t> result;
                                     for (const auto& [other, edge] : beside[t]) {
                                       if (edge.first == here || edge.second == here) result.push_back(other);
                                     }
                                     return result;
                                   }) > 1;
  }
  std::set<std::size_t> all;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) all.insert(i);
  found.shells = groups(all, [&](std::size_t t) {
    std::vector<std::size_t> result;
    for (const auto& [other, edge] : beside[t]) result.push_back(other);
    return result;
  });
  return found;
}

TEST(Solidity, CountsWhatSetsCount) {
  shapes::Random random(7);
  std::size_t not_manifold = 0;
  for (int round = 0; round < many(80); ++round) {
    // Triangles between few places share many of their edges.
    TriangleMesh mesh;
    const unsigned places = 5 + random.below(20);
    for (unsigned i = 0; i < 2 * places; ++i) mesh.vertices.emplace_back(i % places, 0, 0);
    const unsigned count = 1 + random.below(40);
    while (mesh.triangles.size() < count) {
      const glm::uvec3 t(random.below(2 * places), random.below(2 * places), random.below(2 * places));
      const glm::uvec3 place(t.x % places, t.y % places, t.z % places);
      if (place.x != place.y && place.y != place.z && place.z != place.x) mesh.triangles.push_back(t);
    }
    const Solidity found = of(mesh, 1 + round % 3), expected = by_sets(mesh);
    EXPECT_EQ(found.open_edges, expected.open_edges);
    EXPECT_EQ(found.boundary_loops, expected.boundary_loops);
    EXPECT_EQ(found.non_manifold_edges, expected.non_manifold_edges);
    EXPECT_EQ(found.non_manifold_vertices, expected.non_manifold_vertices);
    EXPECT_EQ(found.misoriented_edges, expected.misoriented_edges);
    EXPECT_EQ(found.shells, expected.shells);
    EXPECT_EQ(found.degenerate_triangles, 0u);
    not_manifold += !found.manifold();
  }
  EXPECT_GT(not_manifold, 3u);
}

}  // namespace
