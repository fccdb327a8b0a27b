// SPDX-License-Identifier: GPL-3.0-or-later
/// Coverage::find_witnesses(), which begins a call with a mesh of which nothing is known.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "check/coverage.h"
#include "shapes.h"

namespace {

using namespace tolvol;

/// A flat fan of n faces whose hub is the first vertex.
TriangleMesh fan(unsigned n) {
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, 0);
  for (unsigned i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n;
    mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), 0);
    mesh.triangles.emplace_back(0, i + 1, (i + 1) % n + 1);
  }
  return mesh;
}

// A search of the hierarchy misses faces at a vertex of very many, unless it is told which.
TEST(FindWitnesses, TakesFacesAtAHubWhole) {
  constexpr double kLimit = 1e-3;
  const TriangleMesh reference = fan(200);
  TriangleMesh mesh = reference;
  mesh.vertices[0].z = 0.9 * kLimit;
  for (std::size_t v = 1; v < mesh.vertices.size(); ++v) mesh.vertices[v].z = 0.1 * kLimit * double(v % 3);
  std::vector<std::uint32_t> all(reference.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  Coverage coverage(reference, kLimit, all.size());
  EXPECT_TRUE(coverage.find_witnesses(all, mesh, all, kLimit, nullptr).triangles.empty());
  std::size_t pieces = 0;
  for (const std::uint32_t face : all) pieces += coverage.piece_count(face);
  EXPECT_EQ(pieces, all.size()) << "no face is cut";
}

}  // namespace
