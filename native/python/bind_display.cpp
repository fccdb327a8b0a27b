// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <cmath>

#include "field/display_grid.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"
#include "reference/errors.h"

namespace tolvol::python {
namespace {

/// A DisplayGrid, and where it is.
struct Display {
  DisplayGrid native;
  Frame frame;
  double tolerance;  ///< in the frame

  glm::dvec3 node(const glm::dvec3& in_frame) const { return (in_frame - native.grid.origin) / native.grid.spacing; }
};

std::unique_ptr<Display> make_display(const Volume& volume, double precision, int longest, std::size_t nodes,
                                      int threads, Progress* progress) {
  if (!(precision > 0 && std::isfinite(precision))) throw InvalidInput("the precision must be a positive number");
  // The least that a grid comes down to is the band's eight or so nodes along each axis.
  if (longest < 16 || nodes < 4096) throw InvalidInput("a grid needs at least 16 nodes along an axis and 4096 in all");
  const ToleranceVolume& v = volume.native;
  const DisplayGrid::Options options{precision, longest, nodes, to_threads(threads), progress};
  const Interruptible call(progress);
  return std::unique_ptr<Display>(
      new Display{{v.reference(), v.mirrored(), v.frame_tolerance(), options}, v.frame(), v.frame_tolerance()});
}

template <class T>
py::array_t<T> nodes_of(const py::object& self, std::vector<T> DistanceGrid::*values) {
  const DistanceGrid& g = py::cast<const Display&>(self).native.grid;
  const auto size = static_cast<py::ssize_t>(sizeof(T)), row = size * g.pitch;
  py::array_t<T> view({py::ssize_t{g.nodes.z}, py::ssize_t{g.nodes.y}, py::ssize_t{g.nodes.x}},
                      {row * g.nodes.y, row, size}, (g.*values).data(), self);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

py::array_t<float> corners(const py::object& self) {
  const std::vector<glm::vec3>& c = py::cast<const Display&>(self).native.corners;
  py::array_t<float> view({static_cast<py::ssize_t>(c.size() / 3), py::ssize_t{3}, py::ssize_t{3}},
                          c.empty() ? nullptr : &c[0].x, self);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

py::array_t<double> to_nodes(const Display& display) {
  const double scale = display.frame.scale() / display.native.grid.spacing;
  const glm::dvec3 shift = display.node(display.frame.from_world(glm::dvec3(0)));
  py::array_t<double> matrix({4, 4});
  auto m = matrix.mutable_unchecked<2>();
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) m(i, j) = i == j ? (i < 3 ? scale : 1.0) : (j == 3 ? shift[i] : 0.0);
  }
  return matrix;
}

std::vector<double> shares(const Display& display, const py::object& vertices, const py::object& triangles,
                           std::vector<double> edges, const py::object& to_world, bool nearest, int threads,
                           Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  const Placement placement = Placement(to_matrix(to_world), v.storage).in(display.frame);
  const unsigned count = to_threads(threads);
  const Interruptible call(progress);
  validate(v.values, t);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    edges[i] *= display.frame.scale() / display.native.grid.spacing;
    if (!std::isfinite(edges[i]) || (i > 0 && edges[i] < edges[i - 1])) {
      throw InvalidInput("edges must be finite and ascending");
    }
  }
  std::vector<glm::dvec3> nodes = placement.frame(v.values);
  for (glm::dvec3& p : nodes) p = display.node(p);
  return area_shares(display.native, nearest, nodes, t, edges, count);
}

}  // namespace

void bind_display(py::module_& module) {
  py::class_<Display>(module, "DisplayGrid", py::module_local(),
                      "Signed distances on a regular grid, to show a mesh by: what pictures and viewports interpolate. "
                      "Proves nothing.")
      .def(py::init(&make_display), py::arg("volume"), py::arg("precision") = DisplayGrid::Options().precision,
           py::arg("longest") = DisplayGrid::Options().longest, py::arg("nodes") = DisplayGrid::Options().nodes,
           py::arg("threads") = 0, py::arg("progress") = py::none(),
           "precision: nodes per tolerance, halved until no axis has more than `longest` nodes and all together no "
           "more than `nodes`.\n"
           "Raises InvalidInput, Cancelled. Cost: about 0.5 s for 270,000 triangles at 1 % of their size.")
      .def_property_readonly(
          "distances", [](const py::object& self) { return nodes_of(self, &DistanceGrid::distance); },
          "(nz, ny, nx) float32, a read-only view: in units of the spacing, negative inside, capped at the band. "
          "Across the "
          "continuation of an open reference's border they jump; shaders/signed_distance.glsl interpolates them with "
          "that in mind.")
      .def_property_readonly(
          "nearest", [](const py::object& self) { return nodes_of(self, &DistanceGrid::triangle); },
          "(nz, ny, nx) uint32, a read-only view: the triangle that each node is nearest to, 4294967295 beyond the "
          "band.")
      .def_property_readonly("corners", &corners,
                             "(m, 3, 3) float32, a read-only view: the corners of the reference's triangles, in nodes, "
                             "turned so that their fronts are outside.")
      .def_property_readonly_static(
          "INTERPOLATED", [](const py::object&) { return DisplayGrid::kInterpolated; },
          "The precision from which on distances may be interpolated. A coarser grid makes up too much at edges: there "
          "take the nearest of the triangles of the eight nodes around, as shaders/nearest_distance.glsl does.")
      .def_property_readonly("to_nodes", &to_nodes, "(4, 4) float64: from the world to nodes, x first.")
      .def_property_readonly(
          "spacing", [](const Display& d) { return d.native.grid.spacing / d.frame.scale(); },
          "Between nodes, world units.")
      .def_property_readonly(
          "band", [](const Display& d) { return d.native.grid.band / d.frame.scale(); },
          "Distances are capped here, world units: larger tolerances cannot be told.")
      .def_property_readonly(
          "precision", [](const Display& d) { return d.tolerance / d.native.grid.spacing; }, "Nodes per tolerance.")
      .def_property_readonly(
          "closed", [](const Display& d) { return d.native.closed; },
          "Whether the reference has an inside: every edge has two faces that agree on it. Elsewhere signs are a "
          "guess.")
      .def("shares", &shares, py::arg("vertices"), py::arg("triangles"), py::arg("edges"),
           py::arg("to_world") = py::none(), py::arg("nearest") = false, py::arg("threads") = 0,
           py::arg("progress") = py::none(),
           "The shares of a mesh's area, 0 to 1, whose signed distance lies between ascending `edges` (world units): "
           "len(edges) + 1\n"
           "numbers, from beyond the first to beyond the last. By one sample a triangle and 65,536 more, "
           "interpolated or,\n"
           "with nearest=True, from triangles. About 10 ms.");
}

}  // namespace tolvol::python
