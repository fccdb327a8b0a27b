// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include "measure/deviation.h"
#include "measure/hausdorff.h"
#include "python/arrays.h"
#include "python/module.h"

namespace tolvol::python {
namespace {

TriangleMesh to_mesh(const py::object& vertices, const py::object& triangles, const std::string& suffix) {
  return {to_vertices(vertices, "vertices" + suffix).values, to_triangles(triangles, "triangles" + suffix)};
}

}  // namespace

void bind_measure(py::module_& module) {
  py::class_<HausdorffInterval>(module, "HausdorffInterval", py::module_local(), "What hausdorff found.")
      .def_readonly("lower", &HausdorffInterval::lower)
      .def_readonly("upper", &HausdorffInterval::upper)
      .def_property_readonly(
          "position",
          [](const HausdorffInterval& i) { return py::make_tuple(i.position.x, i.position.y, i.position.z); },
          "The point of a where the distance is at least `lower`.")
      .def_readonly("triangle", &HausdorffInterval::triangle, "The triangle of a it lies on.");
  module.def(
      "hausdorff",
      [](const py::object& va, const py::object& ta, const py::object& vb, const py::object& tb,
         std::optional<double> bound, int threads, Progress* progress) {
        const TriangleMesh a = to_mesh(va, ta, "_a"), b = to_mesh(vb, tb, "_b");
        const py::gil_scoped_release release;
        return hausdorff(a, b, {bound, to_threads(threads), progress});
      },
      py::arg("vertices_a"), py::arg("triangles_a"), py::arg("vertices_b"), py::arg("triangles_b"),
      py::arg("bound") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
      "The largest distance of a point of a to b, as a certified interval: lower <= distance <= upper in exact "
      "arithmetic. World\n"
      "coordinates. Refined until it decides against `bound`, and until upper - lower <= 1 % of upper. Cost: about 2 "
      "us a\n"
      "triangle. Raises InvalidInput, Cancelled.");

  py::class_<Deviation>(module, "Deviation", py::module_local(),
                        "What deviation found; distances in the units of the meshes.")
      .def_readonly("mean", &Deviation::mean, "Weighted by area.")
      .def_readonly("rms", &Deviation::rms, "Weighted by area.")
      .def_property_readonly(
          "share_beyond", [](const Deviation& d) { return from_vector<double>(d.share_beyond); },
          "(k,) float64: the share of the area that is farther than each bound, 0 to 1.")
      .def_readonly("spacing", &Deviation::spacing, "Side of the square that a sample stands for.")
      .def_readonly("samples", &Deviation::samples);
  module.def(
      "deviation",
      [](const py::object& va, const py::object& ta, const py::object& vb, const py::object& tb,
         const std::vector<double>& bounds, int threads, Progress* progress) {
        const TriangleMesh a = to_mesh(va, ta, "_a"), b = to_mesh(vb, tb, "_b");
        const py::gil_scoped_release release;
        return deviation(a, b, bounds, {to_threads(threads), progress});
      },
      py::arg("vertices_a"), py::arg("triangles_a"), py::arg("vertices_b"), py::arg("triangles_b"),
      py::arg("bounds") = std::vector<double>(), py::arg("threads") = 0, py::arg("progress") = py::none(),
      "Mean, RMS and shares of the distance from a to b, by samples spread evenly over the area of a (deterministic, "
      "at least one\n"
      "a triangle). World coordinates. Cost: about 1 us a sample. Raises InvalidInput, Cancelled.");
}

}  // namespace tolvol::python
