// SPDX-License-Identifier: GPL-3.0-or-later
/// Coverage::find_witnesses(), which begins a call with a mesh of which nothing is known.
#include <gtest/gtest.h>

#include <numeric>
#include <tuple>
#include <vector>

#include "check/coverage.h"
#include "shapes.h"

namespace {

using namespace tolvol;

// A search of the hierarchy misses faces at a vertex of very many, unless it is told which.
TEST(FindWitnesses, TakesFacesAtAHubWhole) {
  constexpr double kLimit = 1e-3;
  const TriangleMesh reference = shapes::fan(200);
  TriangleMesh mesh = reference;
  mesh.vertices[0].z = 0.9 * kLimit;
  for (std::size_t v = 1; v < mesh.vertices.size(); ++v) mesh.vertices[v].z = 0.1 * kLimit * double(v % 3);
  std::vector<std::uint32_t> all(reference.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  Coverage coverage(reference, kLimit, all.size());
  EXPECT_TRUE(coverage.find_witnesses(all, mesh, all, kLimit, 1, nullptr).triangles.empty());
  std::size_t pieces = 0;
  for (const std::uint32_t face : all) pieces += coverage.piece_count(face);
  EXPECT_EQ(pieces, all.size()) << "no face is cut";
}

// Some triangles have one witness, some are divided among several, and some are out of reach.
TEST(FindWitnesses, ThreadsDoNotChangeABit) {
  constexpr double kLimit = 0.002;
  const TriangleMesh reference = shapes::sphere(80);
  TriangleMesh mesh = shapes::sphere(20);
  mesh.triangles.pop_back();
  ASSERT_GT(reference.triangles.size(), std::size_t{1} << 16);
  std::vector<std::uint32_t> all(reference.triangles.size()), faces(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0u), std::iota(faces.begin(), faces.end(), 0u);
  const auto found = [&](unsigned threads) {
    Coverage coverage(reference, kLimit, faces.size());
    const Coverage::Uncovered uncovered = coverage.find_witnesses(all, mesh, faces, kLimit, threads, nullptr);
    std::vector<std::size_t> pieces;
    for (const std::uint32_t face : faces) pieces.push_back(coverage.piece_count(face));
    return std::tuple(uncovered.triangles, uncovered.nearest, uncovered.in_part.size(), pieces);
  };
  const auto alone = found(1);
  EXPECT_GT(std::get<0>(alone).size(), 0u) << "some are out of reach";
  EXPECT_LT(std::get<0>(alone).size(), all.size());
  EXPECT_GT(std::accumulate(std::get<3>(alone).begin(), std::get<3>(alone).end(), std::size_t{0}),
            all.size() - std::get<0>(alone).size())
      << "some are divided";
  EXPECT_EQ(found(4), alone);
}

}  // namespace
