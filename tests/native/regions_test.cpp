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
    std::set<std::uint32_t> around{found.of_vertex(std::uint32_t(v.idx()))};
    for (const auto near : mesh.connectivity().vv_range(v)) around.insert(found.of_vertex(std::uint32_t(near.idx())));
    around.erase(Regions::kNone);
    ASSERT_LE(around.size(), 1u) << "vertex " << v.idx();
  }
}

std::vector<std::uint32_t> labels(const BoundedMesh& mesh, const Regions& found) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t v = 0; v < mesh.connectivity().n_vertices(); ++v) all.push_back(found.of_vertex(v));
  return all;
}

/// Cells overlap in no inner point, a region's vertices and their neighbours are in its own, and a search finds a box's
/// cells.
void expect_in_cells(const BoundedMesh& mesh, const Regions& found) {
  for (std::uint32_t a = 0; a < found.count(); ++a) {
    for (std::uint32_t b = 0; b < a; ++b) {
      const glm::dvec3 lower = glm::max(found.cell(a).lower, found.cell(b).lower),
                       upper = glm::min(found.cell(a).upper, found.cell(b).upper);
      EXPECT_TRUE(lower.x >= upper.x || lower.y >= upper.y || lower.z >= upper.z) << a << ", " << b;
    }
  }
  for (std::uint32_t v = 0; v < mesh.connectivity().n_vertices(); ++v) {
    const std::uint32_t region = found.of_vertex(v);
    if (region == Regions::kNone) continue;
    EXPECT_TRUE(meet({mesh.stored(v), mesh.stored(v)}, found.cell(region)));
    for (const auto near : mesh.connectivity().vv_range(BoundedMesh::handle(v))) {
      const glm::dvec3& p = mesh.stored(std::uint32_t(near.idx()));
      EXPECT_TRUE(meet({p, p}, found.cell(region)));
    }
    const Box around{mesh.stored(v) - 0.1, mesh.stored(v) + 0.1};
    std::set<std::uint32_t> met, expected;
    found.for_each_meeting(around, [&](std::uint32_t cell) { EXPECT_TRUE(met.insert(cell).second); });
    for (std::uint32_t cell = 0; cell < found.count(); ++cell) {
      if (meet(around, found.cell(cell))) expected.insert(cell);
    }
    EXPECT_EQ(met, expected);
  }
}

TEST(Regions, HaveNothingToDoWithEachOther) {
  Team team(2);
  for (const TriangleMesh& shape :
       {shapes::torus(60), shapes::grid(60), shapes::joined(shapes::box(20), shapes::grid(30))}) {
    const BoundedMesh mesh = mesh_of(shape);
    for (const double first : {0.5, 0.35}) {
      const Regions found(mesh, 300, first, team);
      Team alone(1);
      EXPECT_EQ(labels(mesh, found), labels(mesh, Regions(mesh, 300, first, alone)));
      expect_apart(mesh, found);
      expect_in_cells(mesh, found);
      std::vector<std::size_t> size(found.count(), 0);
      std::size_t inside = 0;
      for (const std::uint32_t region : labels(mesh, found)) {
        if (region != Regions::kNone) ++size[region], ++inside;
      }
      EXPECT_LE(*std::max_element(size.begin(), size.end()), 300u);
      EXPECT_GE(found.count() * 300, shape.vertices.size());
      EXPECT_GT(inside, shape.vertices.size() / 2) << "rims are the smaller part";
    }
    EXPECT_NE(labels(mesh, Regions(mesh, 300, 0.5, team)), labels(mesh, Regions(mesh, 300, 0.35, team)));
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
  const Regions found(mesh, 5000, 0.5, team);
  EXPECT_EQ(found.count(), 1u);
  for (std::uint32_t v = 0; v < slots.size(); ++v) {
    EXPECT_EQ(found.of_vertex(v), v == vertex || v == copy ? Regions::kNone : 0u);
  }
}

}  // namespace
