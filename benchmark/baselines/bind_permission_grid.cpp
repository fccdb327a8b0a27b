// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include "baselines/module.h"
#include "baselines/permission_grid.h"
#include "python/arrays.h"

namespace tolvol::baselines {
namespace {

namespace py = pybind11;

PermissionGrid make(const py::object& vertices, const py::object& triangles, double tolerance, double precision,
                    std::optional<int> threads) {
  const TriangleMesh mesh{python::to_vertices(vertices, "vertices").values,
                          python::to_triangles(triangles, "triangles")};
  validate(mesh.vertices, mesh.triangles);
  return PermissionGrid(mesh, tolerance, precision, python::to_threads(threads));
}

py::array_t<bool> permits(const PermissionGrid& grid, const py::object& points) {
  const std::vector<glm::dvec3> p = python::to_vertices(points, "points").values;
  std::vector<bool> result(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) result[i] = grid.permits(grid.cell_of(p[i]));
  return python::from_vector<bool>(result);
}

}  // namespace

void bind_permission_grid(py::module_& module) {
  py::class_<PermissionGrid>(module, "PermissionGrid", py::module_local(),
                             "The tolerance volume as a bit per cell [Zelinka and Garland 2002].")
      .def(py::init(&make), py::arg("vertices"), py::arg("triangles"), py::arg("tolerance"), py::arg("precision") = 4.0,
           py::arg("threads") = py::none(),
           "vertices: (n, 3), world units. precision: cells per tolerance. A cell is permitted when it lies completely "
           "inside\n"
           "the volume. O(cells).")
      .def("permits", &permits, py::arg("points"), "(k,) bool: whether the cell of each of (k, 3) points is permitted.")
      .def_property_readonly("spacing", &PermissionGrid::spacing, "Edge of a cell.")
      .def_property_readonly("memory", &PermissionGrid::memory, "Bytes held.");
}

}  // namespace tolvol::baselines
