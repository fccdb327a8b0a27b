// SPDX-License-Identifier: GPL-3.0-or-later
/// What the tests of close_holes() share: meshes with holes, and the judge of what became of them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <set>
#include <vector>

#include "geometry/weld.h"
#include "measure/hausdorff.h"
#include "repair/close_holes.h"
#include "shapes.h"
#include "topology/crossings.h"
#include "topology/sides.h"
#include "topology/solidity.h"
#include "without.h"

namespace tolvol::holes {

using glm::dvec3;

inline const StoredSpace kSpace(glm::dmat4(1), Storage::float64);

inline std::unique_ptr<ToleranceVolume> volume_of(const TriangleMesh& mesh, double tolerance) {
  return std::make_unique<ToleranceVolume>(mesh.vertices, mesh.triangles, kSpace, tolerance);
}

inline HoleClosingResult close(const TriangleMesh& mesh, double tolerance, const CloseHolesOptions& options = {}) {
  return close_holes(mesh.vertices, mesh.triangles, kSpace, *volume_of(mesh, tolerance), options);
}

inline Solidity solidity_of(const TriangleMesh& mesh) {
  Team team(1);
  return solidity(mesh.vertices, mesh.triangles, team);
}

/// The mesh without triangles that run through the same three places as an earlier one in the same direction.
inline TriangleMesh each_once(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> place = weld_equal_positions(mesh.vertices);
  std::set<std::array<std::uint32_t, 3>> seen;
  return without(mesh, [&](unsigned t) {
    const glm::uvec3& c = mesh.triangles[t];
    std::array<std::uint32_t, 3> at{place[c.x], place[c.y], place[c.z]};
    std::rotate(at.begin(), std::min_element(at.begin(), at.end()), at.end());
    return !seen.insert(at).second;
  });
}

/// Judges by what close_holes() does not use that the result keeps its promises about a mesh and a reference.
inline void judge(const TriangleMesh& mesh, const TriangleMesh& reference, const HoleClosingResult& result,
                  double tolerance) {
  const std::size_t before = mesh.triangles.size(), added = result.triangles.size() - before;
  ASSERT_TRUE(std::equal(mesh.triangles.begin(), mesh.triangles.end(), result.triangles.begin()));
  ASSERT_EQ(result.loop.size(), added);
  ASSERT_EQ(result.borders.size(), added);
  ASSERT_EQ(result.corner_source.size(), added);
  const TriangleMesh closed{mesh.vertices, result.triangles};
  if (added > 0) {
    const TriangleMesh only_new{mesh.vertices,
                                {result.triangles.begin() + std::ptrdiff_t(before), result.triangles.end()}};
    EXPECT_LE(hausdorff(only_new, reference, {.bound = tolerance}).upper, tolerance);
  }
  Team team(1);
  for (const glm::uvec2& pair :
       crossings(closed.vertices, closed.triangles, std::numeric_limits<std::size_t>::max(), team, nullptr).pairs) {
    EXPECT_LT(pair.y, before) << "a new face crosses another one";
  }
  const Solidity was = solidity_of(each_once(mesh)), is = solidity_of(each_once(closed));
  EXPECT_EQ(is.non_manifold_edges, was.non_manifold_edges);
  EXPECT_EQ(is.misoriented_edges, was.misoriented_edges);
  EXPECT_EQ(is.degenerate_triangles, was.degenerate_triangles);
  std::size_t filled_edges = 0, triangles = 0;
  for (const HoleClosingResult::Loop& loop : result.loops) {
    if (loop.outcome == LoopOutcome::closed) filled_edges += loop.corners, triangles += loop.corners - 2;
  }
  EXPECT_EQ(is.open_edges + filled_edges, was.open_edges);
  EXPECT_EQ(added, triangles);
  const auto at = [&](std::uint32_t corner) { return mesh.vertices[result.triangles[corner / 3][int(corner % 3)]]; };
  std::size_t at_rim = 0;
  for (std::size_t f = 0; f < added; ++f) {
    const auto first = std::uint32_t(3 * (before + f));
    EXPECT_EQ(result.loops[result.loop[f]].outcome, LoopOutcome::closed);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t source = result.corner_source[f][int(k)], other = result.borders[f][int(k)];
      EXPECT_EQ(at(source), at(first + k));
      if (other == HoleClosingResult::kNone) continue;
      ++at_rim;
      bool runs_against = false;
      for (std::uint32_t side = 3 * other; side < 3 * other + 3; ++side) {
        runs_against |= at(side) == at(first + (k + 1) % 3) && at(next_corner(side)) == at(first + k);
      }
      EXPECT_TRUE(runs_against);
      EXPECT_TRUE(result.corner_source[f][int(k)] / 3 == other || result.borders[f][int((k + 2) % 3)] == source / 3);
    }
  }
  EXPECT_EQ(at_rim, filled_edges);
}

inline void judge(const TriangleMesh& mesh, const HoleClosingResult& result, double tolerance) {
  judge(mesh, mesh, result, tolerance);
}

inline std::vector<LoopOutcome> outcomes(const HoleClosingResult& result) {
  std::vector<LoopOutcome> found;
  for (const HoleClosingResult::Loop& loop : result.loops) found.push_back(loop.outcome);
  return found;
}

using Outcomes = std::vector<LoopOutcome>;

/// A tube of `n` sides about the z axis.
inline TriangleMesh tube(unsigned n, double radius, double length, unsigned rings) {
  TriangleMesh mesh;
  for (unsigned k = 0; k <= rings; ++k) {
    for (unsigned i = 0; i < n; ++i) {
      const double a = 2 * std::numbers::pi * i / n;
      mesh.vertices.emplace_back(radius * std::cos(a), radius * std::sin(a), length * k / rings);
    }
  }
  for (unsigned k = 0; k < rings; ++k) {
    for (unsigned i = 0; i < n; ++i) {
      const unsigned a = k * n + i, b = k * n + (i + 1) % n;
      mesh.triangles.emplace_back(a, b, b + n);
      mesh.triangles.emplace_back(a, b + n, a + n);
    }
  }
  return mesh;
}

/// The grid with noise, without the squares for which drop(i, j) holds.
template <class Drop>
inline TriangleMesh plate(unsigned n, double noise, Drop&& drop) {
  shapes::Random random(2);
  TriangleMesh mesh = shapes::grid(n);
  for (dvec3& p : mesh.vertices) p.z = noise * random.point().x;
  return without(mesh, [&](unsigned t) { return drop(t / 2 / n, t / 2 % n); });
}

}  // namespace tolvol::holes
