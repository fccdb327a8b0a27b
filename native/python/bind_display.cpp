// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <cmath>
#include <limits>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "field/display_tree.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"

namespace tolvol::python {
namespace {

/// A DisplayTree and its frame.
struct Display {
  DisplayTree native;
  Frame frame;
};

std::unique_ptr<Display> make_display(const Volume& volume, Progress* progress) {
  const ToleranceVolume& v = volume.native;
  const Interruptible call(progress);
  return std::unique_ptr<Display>(new Display{{v.reference(), v.mirrored(), progress}, v.frame()});
}

py::array_t<float> texels(const py::object& self, const float* first, std::size_t count) {
  py::array_t<float> view({static_cast<py::ssize_t>(count), py::ssize_t{4}}, first, self);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

py::array_t<double> to_frame(const Display& display) {
  const glm::dvec3 shift = display.frame.from_world(glm::dvec3(0));
  py::array_t<double> matrix({4, 4});
  auto m = matrix.mutable_unchecked<2>();
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      m(i, j) = i == j ? (i < 3 ? display.frame.scale() : 1.0) : (j == 3 ? shift[i] : 0.0);
    }
  }
  return matrix;
}

std::vector<double> shares(const Display& display, const py::object& vertices, const py::object& triangles,
                           std::vector<double> edges, const py::object& to_world, std::optional<int> threads,
                           Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  const StoredSpace space = StoredSpace(to_matrix(to_world), v.storage).in(display.frame);
  const unsigned count = to_threads(threads);
  const Interruptible call(progress);
  validate(v.values, t);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    edges[i] *= display.frame.scale();
    if (!std::isfinite(edges[i]) || (i > 0 && edges[i] < edges[i - 1])) {
      throw InvalidInput("edges must be finite and ascending");
    }
  }
  return area_shares(display.native, space.frame(v.values), t, edges, count);
}

py::array_t<double> signed_distance(const Display& display, const py::object& points, const py::object& to_world,
                                    std::optional<int> threads, Progress* progress) {
  const Vertices v = to_vertices(points, "points");
  const StoredSpace space = StoredSpace(to_matrix(to_world), v.storage).in(display.frame);
  std::vector<double> result(v.values.size());
  {
    const Interruptible call(progress);
    constexpr std::size_t kBlock = 256;
    parallel_for(result.size(), kBlock, to_threads(threads), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const glm::dvec3 at = space.frame(v.values[i]);
        if (!std::isfinite(at.x) || !std::isfinite(at.y) || !std::isfinite(at.z)) {
          throw InvalidInput("point " + std::to_string(i) + " is not finite", "invalid_mesh");
        }
        poll();
        result[i] = display.native.distance(at, std::numeric_limits<double>::infinity()) / display.frame.scale();
      }
    });
  }
  return from_vector<double>(result);
}

}  // namespace

void bind_display(py::module_& module) {
  py::class_<Display>(module, "DisplayTree", py::module_local(),
                      R"doc(The triangles of a volume's reference in a tree of boxes, for a shader.

With it shaders/surface_distance.glsl computes the distance of every pixel. The tree is the same for every tolerance. It
serves to show a mesh and proves nothing.)doc")
      .def(py::init(&make_display), py::arg("volume"), py::kw_only(), py::arg("progress") = py::none(),
           R"doc(Build the tree.

Parameters
----------
volume : ToleranceVolume
progress : Progress, optional

Raises
------
InvalidInput
    If the reference has more than 16,777,216 triangles.
Cancelled

Notes
-----
Cost: about 0.1 s for 270,000 triangles.)doc")
      .def_property_readonly(
          "nodes",
          [](const py::object& self) {
            const auto& nodes = py::cast<const Display&>(self).native.nodes;
            return texels(self, &nodes[0].lower.x, 2 * nodes.size());
          },
          R"doc((4 l, 4) float32 for l leaves: two rows a node, read-only.

The first three columns are the two corners of the node's box in the frame. The fourth column holds the first of its
triangles and the one after the last. The halves of node i are the nodes 2 i and 2 i + 1, and the root is node 1.)doc")
      .def_property_readonly(
          "corners",
          [](const py::object& self) {
            const auto& corners = py::cast<const Display&>(self).native.corners;
            return texels(self, &corners[0].x, corners.size());
          },
          "(3 m, 4) float32: the corners of the triangles in the frame, turned so that their fronts are outside; "
          "read-only.")
      .def_property_readonly("to_frame", &to_frame, "(4, 4) float64: maps the world to the frame.")
      .def_property_readonly(
          "scale", [](const Display& d) { return d.frame.scale(); }, "The length in the frame of 1 world unit.")
      .def_property_readonly_static(
          "ROUNDING", [](const py::object&) { return DisplayTree::kRounding; },
          "The rounding of a distance in a shader, as a length in the frame. What is nearer is shown as no distance.")
      .def_property_readonly(
          "closed", [](const Display& d) { return d.native.closed; },
          "Whether the reference has an inside: every edge has two faces that agree on it. Otherwise signs are a "
          "guess.")
      .def("shares", &shares, py::arg("vertices"), py::arg("triangles"), py::arg("edges"), py::kw_only(),
           py::arg("to_world") = py::none(), py::arg("threads") = py::none(), py::arg("progress") = py::none(),
           R"doc(Return the shares of a mesh's area whose signed distance lies between given edges.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
triangles : (m, 3) integer array
edges : sequence of k floats
    Ascending, in world units.
to_world, threads, progress
    See help(tolvol).

Returns
-------
list of k + 1 floats
    From 0 to 1: from the share beyond the first edge to the share beyond the last one. What is farther away than all
    edges, on either side, is in the last share.

Raises
------
InvalidInput
Cancelled

Notes
-----
The shares are estimates by one sample a triangle and 65,536 more, or by fewer where a search takes long, as between
thousands of needles that run aslant. Cost: about 0.3 s of one thread for 270,000 triangles, and some seconds for 100,000
such needles.)doc")
      .def("signed_distance", &signed_distance, py::arg("points"), py::kw_only(), py::arg("to_world") = py::none(),
           py::arg("threads") = py::none(), py::arg("progress") = py::none(),
           R"doc(Return the distances of points from the reference, negative inside it.

The side is the one that is shown. See `closed`. Distances from triangles in single precision: `ToleranceVolume.distance`
is exact.

Parameters
----------
points : (n, 3) float32 or float64 array
    Local coordinates.
to_world, threads, progress
    See help(tolvol).

Returns
-------
(n,) float64 array
    World units.

Raises
------
InvalidInput
Cancelled

Notes
-----
Cost: about 1 us for a point near the reference.)doc");
}

}  // namespace tolvol::python
