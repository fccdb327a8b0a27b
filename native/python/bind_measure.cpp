// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include "measure/deviation.h"
#include "measure/hausdorff.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"

namespace tolvol::python {
namespace {

TriangleMesh to_mesh(const py::object& vertices, const py::object& triangles, const std::string& suffix) {
  return {to_vertices(vertices, "vertices" + suffix).values, to_triangles(triangles, "triangles" + suffix)};
}

py::tuple to_pair(const Range& range) { return py::make_tuple(range.lower, range.upper); }

py::array_t<double> values_of(const std::vector<Estimate>& estimates) {
  std::vector<double> values;
  values.reserve(estimates.size());
  for (const Estimate& estimate : estimates) values.push_back(estimate.value);
  return from_vector<double>(values);
}

py::array_t<double> ranges_of(const std::vector<Estimate>& estimates) {
  py::array_t<double> ranges({py::ssize_t(estimates.size()), py::ssize_t(2)});
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    ranges.mutable_at(i, 0) = estimates[i].range.lower;
    ranges.mutable_at(i, 1) = estimates[i].range.upper;
  }
  return ranges;
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
        const Interruptible call(progress);
        return hausdorff(a, b, {bound, to_threads(threads), progress});
      },
      py::arg("vertices_a"), py::arg("triangles_a"), py::arg("vertices_b"), py::arg("triangles_b"),
      py::arg("bound") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
      "The largest distance of a point of a to b, as a certified interval: lower <= distance <= upper in exact "
      "arithmetic. World\n"
      "coordinates. Refined until it decides against `bound`, and until upper - lower <= 1 % of upper. Cost: about 2 "
      "us a\n"
      "triangle. Corners of b that are far away neither widen the interval nor cost time. Raises InvalidInput, "
      "Cancelled.");

  py::class_<Sides>(module, "Sides", py::module_local(), "The two sides of a closed surface; outside is above 0.")
      .def_property_readonly(
          "mean", [](const Sides& s) { return s.mean.value; }, "With its sign, weighted by area.")
      .def_property_readonly("mean_range", [](const Sides& s) { return to_pair(s.mean.range); })
      .def_property_readonly(
          "share_inside", [](const Sides& s) { return s.share_inside.value; }, "Of the area, 0 to 1.")
      .def_property_readonly("share_inside_range", [](const Sides& s) { return to_pair(s.share_inside.range); })
      .def_property_readonly(
          "inside", [](const Sides& s) { return to_pair(s.inside); },
          "Range of the largest distance inside, 0 or more.")
      .def_property_readonly(
          "outside", [](const Sides& s) { return to_pair(s.outside); }, "The same outside.");
  py::class_<Deviation>(
      module, "Deviation", py::module_local(),
      "What deviation found; distances in the units of the meshes. A `..._range` is the interval that "
      "the true number is in,\n"
      "whatever lies between the samples.")
      .def_property_readonly(
          "mean", [](const Deviation& d) { return d.mean.value; }, "Weighted by area, as all of these.")
      .def_property_readonly("mean_range", [](const Deviation& d) { return to_pair(d.mean.range); })
      .def_readonly("mean_error", &Deviation::mean_error, "The standard error of the mean is at most this.")
      .def_property_readonly("rms", [](const Deviation& d) { return d.rms.value; })
      .def_property_readonly("rms_range", [](const Deviation& d) { return to_pair(d.rms.range); })
      .def_property_readonly(
          "share_beyond", [](const Deviation& d) { return values_of(d.share_beyond); },
          "(k,) float64: the share of the area that is farther than each bound, 0 to 1.")
      .def_property_readonly(
          "share_beyond_range", [](const Deviation& d) { return ranges_of(d.share_beyond); }, "(k, 2) float64.")
      .def_property_readonly(
          "percentiles", [](const Deviation& d) { return values_of(d.percentiles); },
          "(p,) float64: the least distance that so many % of the area do not exceed.")
      .def_property_readonly(
          "percentiles_range", [](const Deviation& d) { return ranges_of(d.percentiles); }, "(p, 2) float64.")
      .def_property_readonly(
          "distances", [](const Deviation& d) { return from_vector<double>(d.distances); },
          "(samples,) float64, for histograms; below 0 inside, where b is closed.")
      .def_property_readonly(
          "weights", [](const Deviation& d) { return from_vector<double>(d.weights); },
          "(samples,) float64: the share of the area that each sample stands for, together 1.")
      .def_readonly("sides", &Deviation::sides, "Sides where b is closed, else None.")
      .def_readonly("spacing", &Deviation::spacing, "Side of the square that a sample stands for, in the middle.");
  module.def(
      "deviation",
      [](const py::object& va, const py::object& ta, const py::object& vb, const py::object& tb,
         const std::vector<double>& bounds, const std::vector<double>& percentiles, int threads, Progress* progress) {
        const TriangleMesh a = to_mesh(va, ta, "_a"), b = to_mesh(vb, tb, "_b");
        const Interruptible call(progress);
        return deviation(a, b, {bounds, percentiles, to_threads(threads), progress});
      },
      py::arg("vertices_a"), py::arg("triangles_a"), py::arg("vertices_b"), py::arg("triangles_b"),
      py::arg("bounds") = std::vector<double>(), py::arg("percentiles") = std::vector<double>(), py::arg("threads") = 0,
      py::arg("progress") = py::none(),
      "Mean, RMS, percentiles (0 to 100) and shares beyond bounds of the distance from a to b, over the area of a, "
      "each "
      "with the\n"
      "range that it is certainly in. Refined until the range of the mean is no wider than 0.1 % of the largest "
      "distance "
      "or than rounding, or there\n"
      "are half a million samples (four for each triangle where that is more), or\n"
      "the search has taken 256 steps for each of so many, as between crowded needles: the ranges are then wider, and\n"
      "as certain. World coordinates, deterministic. Cost: 2 to 10 us a sample. Raises InvalidInput, Cancelled.");
}

}  // namespace tolvol::python
