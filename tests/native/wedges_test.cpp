// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/wedges.h"

#include <gtest/gtest.h>

#include <set>

#include "shapes.h"

namespace {

using namespace tolvol;

TEST(Wedges, EqualExactlyWhereVertexAndValuesAre) {
  const std::vector<glm::uvec3> triangles{{0, 1, 2}, {0, 2, 3}};
  const std::vector<float> values{0, 0, 1, 0, 1, 1, /**/ -0.0f, 0, 1, 1.5f, 0, 1};
  const std::vector<std::uint32_t> labels = wedge_labels(triangles, values, 2);
  EXPECT_EQ(labels[0], labels[3]) << "0 and -0 are one value";
  EXPECT_NE(labels[2], labels[4]) << "vertex 2, other values";
  EXPECT_EQ(std::set(labels.begin(), labels.end()).size(), 5u);
}

TEST(Islands, EndAtSeams) {
  const TriangleMesh mesh = shapes::grid(4);
  std::vector<glm::uvec3> wedges = mesh.triangles;  // no seam: the vertex is the wedge
  for (const std::uint32_t label : island_labels(mesh.triangles, wedges)) EXPECT_EQ(label, 0u);
  // A seam along the line x = 1/2: corners of the right half get wedges of their own.
  for (std::size_t i = 0; i < wedges.size(); ++i) {
    double x = 0;
    for (int k = 0; k < 3; ++k) x += mesh.vertices[mesh.triangles[i][k]].x / 3;
    if (x > 0.5) wedges[i] += 100u;
  }
  const std::vector<std::uint32_t> islands = island_labels(mesh.triangles, wedges);
  EXPECT_EQ(std::set(islands.begin(), islands.end()).size(), 2u);
  for (std::size_t i = 0; i < wedges.size(); ++i) EXPECT_EQ(islands[i] == islands[0], wedges[i].x < 100);
}

}  // namespace
