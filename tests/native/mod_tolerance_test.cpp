// SPDX-License-Identifier: GPL-3.0-or-later
// ModToleranceT in OpenMesh's own decimaters, judged by measure/hausdorff.h on the mesh as OpenMesh stores it.
#include "openmesh/ModToleranceT.hh"

#include <gtest/gtest.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/McDecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "many.h"
#include "measure/hausdorff.h"
#include "shapes.h"

namespace {

using namespace tolvol;

constexpr double kTolerance = 0.03;

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
};
using FloatMesh = OpenMesh::TriMesh_ArrayKernelT<>;
using DoubleMesh = OpenMesh::TriMesh_ArrayKernelT<DoubleTraits>;

template <class Mesh>
Mesh to_openmesh(const TriangleMesh& mesh) {
  Mesh result;
  result.request_vertex_status(), result.request_edge_status(), result.request_face_status();
  for (const glm::dvec3& p : mesh.vertices) result.add_vertex(typename Mesh::Point(p.x, p.y, p.z));
  for (const glm::uvec3& t : mesh.triangles) {
    result.add_face(result.vertex_handle(t.x), result.vertex_handle(t.y), result.vertex_handle(t.z));
  }
  return result;
}

template <class Mesh>
TriangleMesh from_openmesh(const Mesh& mesh) {
  TriangleMesh result;
  for (const auto v : mesh.all_vertices()) result.vertices.push_back(to_dvec3(mesh.point(v)));
  for (const auto f : mesh.faces()) {
    glm::uvec3& t = result.triangles.emplace_back();
    int k = 0;
    for (const auto v : mesh.fv_range(f)) t[k++] = unsigned(v.idx());
  }
  return result;
}

template <class Mesh, template <class> class Decimater = OpenMesh::Decimater::DecimaterT>
void decimate_within(Mesh& mesh, const ToleranceVolume& volume, double factor = 1) {
  Decimater<Mesh> decimater(mesh);
  typename OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
  typename ModToleranceT<Mesh>::Handle tolerance;
  decimater.add(quadric);
  decimater.add(tolerance);
  decimater.module(quadric).unset_max_err();
  decimater.module(tolerance).set_volume(volume);
  ASSERT_TRUE(decimater.initialize());
  if (factor < 1) decimater.module(tolerance).set_error_tolerance_factor(factor);
  decimater.decimate(mesh.n_vertices(), false);
}

double forward(const TriangleMesh& from, const TriangleMesh& to, double bound = kTolerance) {
  return hausdorff(from, to, {bound, 1, nullptr}).upper;
}

template <class Mesh>
class ModTolerance : public testing::Test {};
using Meshes = testing::Types<FloatMesh, DoubleMesh>;
TYPED_TEST_SUITE(ModTolerance, Meshes);

TYPED_TEST(ModTolerance, KeepsTheTolerance) {
  const TriangleMesh reference = shapes::torus(across(40), 0.004);
  auto mesh = to_openmesh<TypeParam>(reference);
  const ToleranceVolume volume = volume_of(mesh, kTolerance);
  decimate_within(mesh, volume);
  const TriangleMesh result = from_openmesh(mesh);
  EXPECT_LT(result.triangles.size(), 500u);
  EXPECT_LE(forward(result, reference), kTolerance);
  EXPECT_GT(forward(result, reference, 0.5 * kTolerance), 0.5 * kTolerance) << "the tolerance is used";
}

TYPED_TEST(ModTolerance, KeepsOneToleranceThroughAChain) {
  const TriangleMesh reference = shapes::torus(across(40), 0.004);
  auto mesh = to_openmesh<TypeParam>(reference);
  const ToleranceVolume volume = volume_of(mesh, kTolerance);
  decimate_within(mesh, volume, 0.3);
  EXPECT_LE(forward(from_openmesh(mesh), reference, 0.3 * kTolerance), 0.3 * kTolerance) << "the factor holds";
  const std::size_t first = from_openmesh(mesh).triangles.size();
  mesh.garbage_collection();
  decimate_within(mesh, volume);
  const TriangleMesh result = from_openmesh(mesh);
  EXPECT_LT(result.triangles.size(), first);
  EXPECT_LE(forward(result, reference), kTolerance);
}

TYPED_TEST(ModTolerance, WorksInOtherDecimaters) {
  const TriangleMesh reference = shapes::torus(30);
  auto mesh = to_openmesh<TypeParam>(reference);
  const ToleranceVolume volume = volume_of(mesh, kTolerance);
  decimate_within<TypeParam, OpenMesh::Decimater::McDecimaterT>(mesh, volume);
  const TriangleMesh result = from_openmesh(mesh);
  EXPECT_LT(result.triangles.size(), reference.triangles.size() / 2);
  EXPECT_LE(forward(result, reference), kTolerance);
}

TYPED_TEST(ModTolerance, RefusesWhatItCannotProve) {
  auto mesh = to_openmesh<TypeParam>(shapes::torus(20));
  OpenMesh::Decimater::DecimaterT<TypeParam> decimater(mesh);
  typename OpenMesh::Decimater::ModQuadricT<TypeParam>::Handle quadric;
  typename ModToleranceT<TypeParam>::Handle tolerance;
  decimater.add(quadric), decimater.add(tolerance);
  EXPECT_TRUE(decimater.module(tolerance).is_binary());
  EXPECT_THROW(decimater.initialize(), InvalidInput) << "no volume";

  const ToleranceVolume volume = volume_of(mesh, kTolerance);
  decimater.module(tolerance).set_volume(volume);
  const auto corner = mesh.vertex_handle(7);
  const auto kept = mesh.point(corner);
  const std::pair<double, const char*> moves[] = {{1.0, "face "},
                                                  {std::numeric_limits<double>::quiet_NaN(), "point 7 "}};
  for (const auto& [bad, named] : moves) {
    mesh.set_point(corner, kept + typename TypeParam::Point(0, 0, bad));
    try {
      decimater.initialize();
      ADD_FAILURE() << "a vertex was moved by " << bad;
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find(named), std::string::npos) << error.what();
    }
  }
  mesh.set_point(corner, kept);
  EXPECT_TRUE(decimater.initialize());
}

TEST(VolumeOf, RefusesAnEmptyMesh) { EXPECT_THROW(volume_of(FloatMesh(), kTolerance), InvalidInput); }

}  // namespace
