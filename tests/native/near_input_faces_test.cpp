// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/near_input_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>

#include "decimation_cases.h"
#include "topology/faces_cross.h"
#include "topology/input_crossings.h"

namespace {

using namespace tolvol;
using cases::Case;
using cases::Options;
using glm::dvec3;

/// A decimation up to where the mesh was taken, with the tolerance to `c`.
class Taken {
 public:
  explicit Taken(const Case& c) : Taken(c, c.mesh) {}
  Taken(const Case& c, const TriangleMesh& mesh)
      : mesh_(mesh),
        volume_(c.volume()),
        input_(mesh_.vertices, mesh_.triangles, c.space(), volume_.get(), options_, false, team_, report_) {
    input_.take_mesh();
    const MeshView stored = input_.stored_mesh();
    for (std::uint32_t t = 0; t < stored.triangles.size(); ++t) faces_.push_back(stored.corners(t));
    for (const Corners& aside : input_.faces_aside()) faces_.push_back(aside);
  }
  InputCrossings::FindNear find() const { return near_input_faces(input_); }
  const std::vector<Corners>& faces() const { return faces_; }
  std::size_t first_aside() const { return input_.stored_mesh().triangles.size(); }
  InputCrossings crossings(InputCrossings::FindNear find) const {
    return InputCrossings(input_.stored_mesh(), input_.faces_aside(), std::move(find));
  }

 private:
  TriangleMesh mesh_;
  Options options_;
  Team team_{1};
  DecimationResult report_;
  std::unique_ptr<const ToleranceVolume> volume_;
  DecimationInput input_;
  std::vector<Corners> faces_;
};

/// Triangles with corners on a grid, of which many cross others, with segments, points and copies among them.
TriangleMesh tangle(unsigned count) {
  shapes::Random random(4);
  TriangleMesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    const auto whole = [&] { return dvec3(random.below(3), random.below(3), random.below(3)) - dvec3(1); };
    const dvec3 at = 0.5 * dvec3(random.below(12), random.below(12), random.below(12)), along = whole();
    mesh.vertices.insert(mesh.vertices.end(), {at, at + 2.0 * along, at + (i % 5 == 0 ? along : 2.0 * whole())});
    mesh.triangles.emplace_back(first, first + 1, first + 2);
    if (i % 7 == 0) mesh.triangles.emplace_back(first + 1, first + 2, first);
    if (i % 11 == 0) mesh.triangles.emplace_back(first, first, first);
  }
  return mesh;
}

/// Pairs of triangles. The corner of one that is farthest from its centre lies on an edge of the other.
TriangleMesh touching(unsigned count) {
  shapes::Random random(6);
  TriangleMesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const dvec3 at = 3.0 * random.point(), far = at + dvec3(1, 0, 0);
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {at, at + dvec3(0, 0.3, 0), far});
    mesh.vertices.insert(mesh.vertices.end(), {far + dvec3(0, 0.5, 1), far - dvec3(0, 0.5, 1), far + dvec3(1, 0, 0)});
    mesh.triangles.emplace_back(first, first + 1, first + 2);
    mesh.triangles.emplace_back(first + 3, first + 4, first + 5);
  }
  return shapes::stored(mesh);
}

/// Far from the origin, sheared and nearly flat, so that positions in the frame are off by much.
Case of(TriangleMesh mesh) {
  Case c{std::move(mesh)};
  c.to_world[0] = {3, 0.7, 0, 0}, c.to_world[2] = {0.3, 0.2, 1e-5, 0}, c.to_world[3] = {5e6, -3e6, 100, 1};
  return c;
}

TEST(NearInputFaces, HasAllThatCross) {
  struct Expected {
    TriangleMesh mesh;
    std::size_t crossing, of_aside;
  };
  const Expected meshes[] = {{tangle(300), 1'000, 100}, {touching(100), 50, 0}, {shapes::fan(400), 0, 0}};
  for (const auto& [mesh, least_crossing, least_of_aside] : meshes) {
    const Taken taken(of(mesh));
    std::size_t crossing = 0, of_aside = 0;
    for (std::uint32_t face = 0; face < taken.faces().size(); ++face) {
      std::set<std::uint32_t> near;
      ASSERT_TRUE(taken.find()(face, [&](std::uint32_t other) { return near.insert(other).second; }));
      for (std::uint32_t other = 0; other < taken.faces().size(); ++other) {
        if (other == face || !faces_cross(taken.faces()[face], taken.faces()[other])) continue;
        ++crossing, of_aside += std::max(face, other) >= taken.first_aside();
        ASSERT_TRUE(near.contains(other)) << face << " and " << other;
      }
    }
    EXPECT_GE(crossing, least_crossing);
    EXPECT_GE(of_aside, least_of_aside);
  }
}

TEST(NearInputFaces, ItEndsWhereTheVisitSaysSo) {
  const Taken taken(of(shapes::torus(12)));
  int visits = 0;
  EXPECT_TRUE(taken.find()(0, [&](std::uint32_t) { return ++visits < 3; }));
  EXPECT_EQ(visits, 3);
}

TEST(NearInputFaces, NeedlesSideBySideAreSearchedInATree) {
  TriangleMesh needles;  // the sphere around each has all others
  for (std::uint32_t i = 0; i < 500; ++i) {
    const double x = 0.001 * i;
    needles.vertices.insert(needles.vertices.end(), {dvec3(x, 0, 0), dvec3(x + 0.0005, 0, 0), dvec3(x, 1, 0)});
    needles.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  needles.vertices.insert(needles.vertices.end(), {dvec3(0.2, 0.5, -1), dvec3(0.2, 0.5, 1), dvec3(0.2, 0.6, 1)});
  needles.triangles.emplace_back(1500, 1501, 1502);
  const Taken taken(of(shapes::stored(needles)));
  const InputCrossings::FindNear find = taken.find();
  std::size_t visits = 0, refused = 0;
  for (std::uint32_t face = 0; face < taken.faces().size(); ++face) {
    refused += !find(face, [&](std::uint32_t) { return ++visits > 0; });
  }
  EXPECT_LE(visits, 34 * taken.faces().size()) << "not the square of their number";
  EXPECT_GT(refused, 400u);
  const InputCrossings by_hierarchy = taken.crossings(taken.find()), by_tree = taken.crossings({});
  std::vector<std::uint32_t> all(taken.faces().size());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  std::vector<std::uint32_t> one = all, other = all;
  by_hierarchy.keep_crossing(one), by_tree.keep_crossing(other);
  EXPECT_EQ(one, other);
  EXPECT_GT(one.size(), 1u);
  EXPECT_LT(one.size(), 10u);
}

TEST(NearInputFaces, ThereIsNoneForAnotherMeshThanTheReference) {
  const Case c = of(shapes::torus(12));
  EXPECT_FALSE(Taken(c, shapes::turned(c.mesh)).find());
}

}  // namespace
