// SPDX-License-Identifier: GPL-3.0-or-later
/// Coverage::find_witnesses(), which begins a call with a mesh of which nothing is known.
#include <gtest/gtest.h>

#include <numeric>
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
  Team team(1);
  EXPECT_TRUE(coverage.find_witnesses(all, mesh, all, kLimit, team, nullptr).triangles.empty());
  std::size_t pieces = 0;
  for (const std::uint32_t face : all) pieces += coverage.piece_count(face);
  EXPECT_EQ(pieces, all.size()) << "no face is cut";
}

}  // namespace
