// SPDX-License-Identifier: GPL-3.0-or-later
/// OpenMesh's own decimater with its quadric module: the library's way to a triangle count, without any tolerance.
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <chrono>

#include "baselines/module.h"
#include "python/arrays.h"

namespace tolvol::baselines {
namespace {

namespace py = pybind11;
using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;

py::tuple decimate_openmesh(const py::object& vertices, const py::object& triangles, std::size_t target_triangles) {
  const auto v = python::to_vertices(vertices, "vertices").values;
  Mesh mesh;
  const auto start = std::chrono::steady_clock::now();
  for (const glm::dvec3& p : v) mesh.add_vertex(Mesh::Point(glm::vec3(p).x, glm::vec3(p).y, glm::vec3(p).z));
  for (const glm::uvec3& t : python::to_triangles(triangles, "triangles")) {
    mesh.add_face(mesh.vertex_handle(t.x), mesh.vertex_handle(t.y), mesh.vertex_handle(t.z));
  }
  OpenMesh::Decimater::DecimaterT<Mesh> decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
  decimater.add(quadric);
  decimater.module(quadric).unset_max_err();
  decimater.initialize();
  decimater.decimate_to_faces(0, target_triangles);
  mesh.garbage_collection();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  std::vector<glm::dvec3> points;
  for (const auto handle : mesh.vertices())
    points.emplace_back(mesh.point(handle)[0], mesh.point(handle)[1], mesh.point(handle)[2]);
  std::vector<glm::uvec3> faces;
  for (const auto face : mesh.faces()) {
    glm::uvec3 t;
    int k = 0;
    for (const auto handle : mesh.fv_range(face)) t[k++] = static_cast<unsigned>(handle.idx());
    faces.push_back(t);
  }
  return py::make_tuple(python::from_vertices(points, Storage::float32), python::from_triangles(faces), seconds);
}

}  // namespace

void bind_openmesh(py::module_& module) {
  module.def("decimate_openmesh", &decimate_openmesh, py::arg("vertices"), py::arg("triangles"),
             py::arg("target_triangles"),
             "(vertices float32, triangles, seconds) by OpenMesh's DecimaterT with ModQuadricT.");
}

}  // namespace tolvol::baselines
