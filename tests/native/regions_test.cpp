// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/regions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "decimation/bounded_mesh.h"
#include "shapes.h"
#include "topology/manifold_cut.h"

namespace {

using namespace tolvol;

/// `slots`: one per vertex, or none for a vertex each.
BoundedMesh mesh_of(const TriangleMesh& from, std::vector<std::uint32_t> slots = {}) {
  BoundedMeshInput input;
  Team alone(1);
  input.triangles = from.triangles;
  input.mates = cut_to_manifold(from.vertices, from.triangles, alone).mates;
  for (const glm::dvec3& p : from.vertices) input.positions.push_back({p, p});
  input.pinned.assign(from.vertices.size(), false);
  input.slots = std::move(slots);
  for (std::uint32_t v = static_cast<std::uint32_t>(input.slots.size()); v < from.vertices.size(); ++v)
    input.slots.push_back(v);
  input.store = [](const glm::dvec3& p) { return VertexPosition{p, p}; };
  return BoundedMesh(std::move(input), nullptr, alone);
}

/// No vertex has vertices of two regions around it: then no face, and no fan of faces, is changed by two.
void expect_apart(const BoundedMesh& mesh, const Regions& found) {
  for (const auto v : mesh.connectivity().vertices()) {
    std::set<std::uint32_t> around{found.of_vertex[std::size_t(v.idx())]};
    for (const auto near : mesh.connectivity().vv_range(v)) around.insert(found.of_vertex[std::size_t(near.idx())]);
    around.erase(Regions::kNone);
    ASSERT_LE(around.size(), 1u) << "vertex " << v.idx();
  }
}

TEST(Regions, HaveNothingToDoWithEachOther) {
  Team team(2);
  for (const TriangleMesh& shape :
       {shapes::torus(60), shapes::grid(60), shapes::joined(shapes::box(20), shapes::grid(30))}) {
    const BoundedMesh mesh = mesh_of(shape);
    for (const double first : {0.5, 0.35}) {
      const Regions found = regions(mesh, 300, first, team);
      Team alone(1);
      EXPECT_EQ(found.of_vertex, regions(mesh, 300, first, alone).of_vertex);
      expect_apart(mesh, found);
      std::vector<std::size_t> size(found.count, 0);
      std::size_t inside = 0;
      for (const std::uint32_t region : found.of_vertex) {
        if (region != Regions::kNone) ++size[region], ++inside;
      }
      EXPECT_LE(*std::max_element(size.begin(), size.end()), 300u);
      EXPECT_GE(found.count * 300, shape.vertices.size());
      EXPECT_GT(inside, shape.vertices.size() / 2) << "rims are the smaller part";
    }
    EXPECT_NE(regions(mesh, 300, 0.5, team).of_vertex, regions(mesh, 300, 0.35, team).of_vertex);
  }
}

TEST(Regions, LeaveOutWhatHasCopies) {
  Team team(1);
  TriangleMesh beside = shapes::grid(30);
  for (glm::dvec3& p : beside.vertices) p.z += 1;
  const TriangleMesh shape = shapes::joined(shapes::grid(30), beside);
  std::vector<std::uint32_t> slots(shape.vertices.size());
  for (std::uint32_t v = 0; v < slots.size(); ++v) slots[v] = v;
  const std::uint32_t vertex = 15 * 31 + 15, copy = vertex + 31 * 31;
  slots[copy] = vertex;
  const BoundedMesh mesh = mesh_of(shape, slots);
  const Regions found = regions(mesh, 5000, 0.5, team);
  EXPECT_EQ(found.count, 1u);
  for (std::uint32_t v = 0; v < slots.size(); ++v) {
    EXPECT_EQ(found.of_vertex[v], v == vertex || v == copy ? Regions::kNone : 0u);
  }
}

}  // namespace
