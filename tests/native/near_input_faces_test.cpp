// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/near_input_faces.h"

#include <gtest/gtest.h>

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
        input_(mesh_.vertices, mesh_.triangles, c.space(), volume_.get(), options_, true, team_, report_) {
    input_.take_mesh();
    const MeshView stored = input_.stored_mesh();
    for (std::uint32_t t = 0; t < stored.triangles.size(); ++t) faces_.push_back(stored.corners(t));
    for (const Corners& aside : input_.faces_aside()) faces_.push_back(aside);
  }
  InputCrossings::FindNear find() const { return near_input_faces(input_); }
  const std::vector<Corners>& faces() const { return faces_; }
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

/// Triangles that cross others, with degenerate ones and copies among them.
TriangleMesh tangle(unsigned count) {
  shapes::Random random(4);
  TriangleMesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    const dvec3 at = random.point(), along = 0.7 * random.point();
    mesh.vertices.insert(mesh.vertices.end(),
                         {at, at + along, i % 5 == 0 ? at + 0.5 * along : at + 0.7 * random.point()});
    mesh.triangles.emplace_back(first, first + 1, first + 2);
    if (i % 7 == 0) mesh.triangles.emplace_back(first + 1, first + 2, first);
    if (i % 11 == 0) mesh.triangles.emplace_back(first, first, first);
  }
  return shapes::stored(mesh);
}

Case of(TriangleMesh mesh) {
  Case c{std::move(mesh)};
  c.to_world[0] = {3, 0.7, 0, 0}, c.to_world[3] = {5000, -3000, 100, 1};
  return c;
}

TEST(NearInputFaces, HasAllThatCross) {
  for (const TriangleMesh& mesh :
       {tangle(300), shapes::torus(12, 0.1), shapes::fan(400), shapes::soup(shapes::box(4))}) {
    const Taken taken(of(mesh));
    std::size_t crossing = 0;
    for (std::uint32_t face = 0; face < taken.faces().size(); ++face) {
      std::set<std::uint32_t> near;
      ASSERT_TRUE(taken.find()(face, [&](std::uint32_t other) { return near.insert(other).second; }));
      for (std::uint32_t other = 0; other < taken.faces().size(); ++other) {
        if (other == face || !faces_cross(taken.faces()[face], taken.faces()[other])) continue;
        ++crossing;
        ASSERT_TRUE(near.contains(other)) << face << " and " << other;
      }
    }
    if (mesh.triangles.size() == tangle(300).triangles.size()) EXPECT_GT(crossing, 300u);
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
  EXPECT_LE(visits, 10 * taken.faces().size()) << "not the square of their number";
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
