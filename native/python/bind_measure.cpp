// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>

#include "measure/deviation.h"
#include "measure/hausdorff.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"

namespace tolvol::python {
namespace {

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

/// The result of the Python function hausdorff: both directions, and the larger of the two.
struct BothWays {
  HausdorffInterval forward, backward;
};

}  // namespace

void bind_measure(py::module_& module) {
  py::class_<HausdorffInterval>(module, "DirectedHausdorffResult", py::module_local(),
                                "The interval that directed_hausdorff found, in the units of the meshes.")
      .def_readonly("lower", &HausdorffInterval::lower, "The largest distance is at least this.")
      .def_readonly("upper", &HausdorffInterval::upper, "The largest distance is at most this.")
      .def_property_readonly(
          "position",
          [](const HausdorffInterval& i) { return py::make_tuple(i.position.x, i.position.y, i.position.z); },
          "(x, y, z): a point of mesh a whose distance from mesh b is at least `lower`, up to rounding.")
      .def_readonly("triangle", &HausdorffInterval::triangle, "The index of the triangle of mesh a with that point.");
  py::class_<BothWays>(module, "HausdorffResult", py::module_local(),
                       "The interval that hausdorff found, in the units of the meshes.")
      .def_property_readonly(
          "lower", [](const BothWays& b) { return std::max(b.forward.lower, b.backward.lower); },
          "The Hausdorff distance is at least this.")
      .def_property_readonly(
          "upper", [](const BothWays& b) { return std::max(b.forward.upper, b.backward.upper); },
          "The Hausdorff distance is at most this.")
      .def_readonly("forward", &BothWays::forward, "The DirectedHausdorffResult from mesh a to mesh b.")
      .def_readonly("backward", &BothWays::backward, "The DirectedHausdorffResult from mesh b to mesh a.");
  module.def(
      "directed_hausdorff",
      [](const py::object& va, const py::object& ta, const py::object& vb, const py::object& tb,
         std::optional<double> bound, std::optional<int> threads, Progress* progress) {
        const TriangleMesh a = to_mesh(va, ta, "_a"), b = to_mesh(vb, tb, "_b");
        const Interruptible call(progress);
        return hausdorff(a, b, {bound, to_threads(threads), progress});
      },
      py::arg("vertices_a"), py::arg("triangles_a"), py::arg("vertices_b"), py::arg("triangles_b"), py::kw_only(),
      py::arg("bound") = py::none(), py::arg("threads") = py::none(), py::arg("progress") = py::none(),
      R"doc(Return the largest distance of a point of mesh a from mesh b, as a certified interval.

The interval holds the directed Hausdorff distance of the two surfaces, over every point of every triangle and not over
samples, in exact arithmetic on the coordinates as they are given: all rounding is inside the interval.

Parameters
----------
vertices_a, vertices_b : (n, 3) float32 or float64 arrays
    Coordinates in one space, as a rule the world. The result is in their unit.
triangles_a, triangles_b : (m, 3) integer arrays
bound : float, optional
    A length to compare with. The search goes on until upper <= bound or lower > bound. It ends at once if
    lower > bound; the interval may then be wide.
threads, progress
    See help(tolvol).

Returns
-------
DirectedHausdorffResult
    Its `upper` - `lower` is at most 0.1 % of `upper`, unless the distance is rounding itself or the search takes very
    many pieces, as it does between needles that lie on one another. With every 20,000 pieces and 12 for each triangle
    the width may then grow by 0.1 % of the bound, or of a thousandth of the size if that is less, until the search stops
    after a million pieces and 16 for each triangle, or four million as long as it has not decided about the bound. At a
    corner that thousands of triangles share, a piece may count for several. The interval is true in every case.

    Rounding is about 1e-15 of the size of both meshes together. Far corners of mesh b do not add to this size, unless
    they are those of a triangle whose corners are all far away and whose plane passes near mesh a, or of a triangle that
    opens to more than about 170 degrees at its one near corner. Far corners of mesh a always do: with a vertex of mesh a
    at 1e19 the interval may be 1e5 wide.

Raises
------
InvalidInput
    If a mesh is not valid, or if bound is negative or not a number.
Cancelled

Notes
-----
Cost: below 1 us for each triangle of a and of b, then as much for each piece that a is cut into. The two directions
between a scan of 270,000 triangles and its decimation to 200 take 0.1 s each.)doc");
  module.def(
      "hausdorff",
      [](const py::object& va, const py::object& ta, const py::object& vb, const py::object& tb,
         std::optional<double> bound, std::optional<int> threads, Progress* progress) {
        const TriangleMesh a = to_mesh(va, ta, "_a"), b = to_mesh(vb, tb, "_b");
        const HausdorffOptions options{bound, to_threads(threads), progress};
        const Interruptible call(progress);
        const auto measured = [&](const TriangleMesh& from, const TriangleMesh& to, double first) {
          const Progress::Part half(progress, first, first + 0.5);
          return hausdorff(from, to, options);
        };
        const HausdorffInterval forward = measured(a, b, 0);
        return BothWays{forward, measured(b, a, 0.5)};
      },
      py::arg("vertices_a"), py::arg("triangles_a"), py::arg("vertices_b"), py::arg("triangles_b"), py::kw_only(),
      py::arg("bound") = py::none(), py::arg("threads") = py::none(), py::arg("progress") = py::none(),
      R"doc(Return the Hausdorff distance of two meshes, as a certified interval.

This is the larger one of the two directed distances. Parameters, errors and cost are those of directed_hausdorff, which
this function calls for each direction.

Far corners of either mesh are far corners of mesh a in one direction. The interval is then no narrower than about 1e-15 of
the size of that mesh, even if its far corner is on the other mesh, too. `forward` and `backward` tell which direction it is.

Returns
-------
HausdorffResult
    The interval from `lower` to `upper`, and the DirectedHausdorffResult of each direction: `forward` from mesh a to
    mesh b, and `backward` from mesh b to mesh a.)doc");

  py::class_<Sides>(module, "Sides", py::module_local(),
                    "The part of a DeviationResult that tells the two sides of a closed mesh b apart.\n\n"
                    "Distances are above 0 outside of b and below 0 inside.")
      .def_property_readonly(
          "mean", [](const Sides& s) { return s.mean.value; }, "The mean of the signed distance, weighted by area.")
      .def_property_readonly(
          "mean_range", [](const Sides& s) { return to_pair(s.mean.range); },
          "(lower, upper): the true mean lies between them.")
      .def_property_readonly(
          "share_inside", [](const Sides& s) { return s.share_inside.value; },
          "The share of the area of mesh a that is inside, from 0 to 1.")
      .def_property_readonly(
          "share_inside_range", [](const Sides& s) { return to_pair(s.share_inside.range); },
          "(lower, upper): the true share lies between them.")
      .def_property_readonly(
          "inside", [](const Sides& s) { return to_pair(s.inside); },
          "(lower, upper): the largest distance inside lies between them. Neither is negative.")
      .def_property_readonly(
          "outside", [](const Sides& s) { return to_pair(s.outside); },
          "(lower, upper): the largest distance outside lies between them. Neither is negative.");
  py::class_<Deviation>(
      module, "DeviationResult", py::module_local(),
      "The distances from mesh a to mesh b that deviation found, in the units of the meshes.\n\n"
      "Each number is weighted by area. The attribute with the same name and `_range` is the interval that holds the\n"
      "true number, whatever lies between the samples.")
      .def_property_readonly(
          "mean", [](const Deviation& d) { return d.mean.value; }, "The mean distance.")
      .def_property_readonly(
          "mean_range", [](const Deviation& d) { return to_pair(d.mean.range); },
          "(lower, upper): the true mean lies between them.")
      .def_readonly("mean_error", &Deviation::mean_error, "The standard error of the mean is at most this.")
      .def_property_readonly(
          "rms", [](const Deviation& d) { return d.rms.value; }, "The root of the mean squared distance.")
      .def_property_readonly(
          "rms_range", [](const Deviation& d) { return to_pair(d.rms.range); },
          "(lower, upper): the true RMS lies between them.")
      .def_property_readonly(
          "share_beyond", [](const Deviation& d) { return values_of(d.share_beyond); },
          "(k,) float64: for each bound the share of the area that is farther away, from 0 to 1.")
      .def_property_readonly(
          "share_beyond_range", [](const Deviation& d) { return ranges_of(d.share_beyond); },
          "(k, 2) float64: the true shares lie between these.")
      .def_property_readonly(
          "percentiles", [](const Deviation& d) { return values_of(d.percentiles); },
          "(p,) float64: for each percentile the least distance that so many % of the area do not exceed.")
      .def_property_readonly(
          "percentiles_range", [](const Deviation& d) { return ranges_of(d.percentiles); },
          "(p, 2) float64: the true percentiles lie between these.")
      .def_property_readonly(
          "distances", [](const Deviation& d) { return from_vector<double>(d.distances); },
          "(s,) float64: the distance of each sample, for histograms. It is below 0 inside of b, if b is closed.")
      .def_property_readonly(
          "weights", [](const Deviation& d) { return from_vector<double>(d.weights); },
          "(s,) float64: the share of the area that each sample stands for. The sum is 1.")
      .def_readonly("sides", &Deviation::sides, "A Sides object if b is closed, else None.")
      .def_readonly("spacing", &Deviation::spacing,
                    "The side of a square of the area that a sample stands for on average.");
  module.def(
      "deviation",
      [](const py::object& va, const py::object& ta, const py::object& vb, const py::object& tb,
         const std::vector<double>& bounds, const std::vector<double>& percentiles, std::optional<int> threads,
         Progress* progress) {
        const TriangleMesh a = to_mesh(va, ta, "_a"), b = to_mesh(vb, tb, "_b");
        const Interruptible call(progress);
        return deviation(a, b, {bounds, percentiles, to_threads(threads), progress});
      },
      py::arg("vertices_a"), py::arg("triangles_a"), py::arg("vertices_b"), py::arg("triangles_b"), py::kw_only(),
      py::arg("bounds") = py::tuple(), py::arg("percentiles") = py::tuple(), py::arg("threads") = py::none(),
      py::arg("progress") = py::none(),
      R"doc(Return mean, RMS, percentiles and shares of the distance from mesh a to mesh b, over the area of mesh a.

Each number comes with a range that certainly holds the true one. The result is deterministic.

Parameters
----------
vertices_a, vertices_b : (n, 3) float32 or float64 arrays
    Coordinates in one space, as a rule the world. The result is in their unit.
triangles_a, triangles_b : (m, 3) integer arrays
bounds : sequence of k floats, optional
    Lengths of 0 or more. For each the result holds the share of the area that is farther away.
percentiles : sequence of p floats, optional
    Percentages from 0 to 100.
threads, progress
    See help(tolvol).

Returns
-------
DeviationResult

Raises
------
InvalidInput
    If a mesh is not valid, or if a bound or a percentile is out of range.
Cancelled

Notes
-----
Mesh a is cut into pieces, and each piece holds one sample. The cutting ends as soon as the range of the mean is no
wider than 0.1 % of the largest distance or than rounding. It ends earlier at about 229,000 samples (four for each
triangle if that is more), and after 128 steps of search for each of so many samples, as between crowded needles: the
ranges are then wider, and as certain.

The mean is more exact than the mean of the samples: bounds over whole pieces enter it, too.

Cost: 2 to 15 us a sample.)doc");
}

}  // namespace tolvol::python
