// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"
#include "repair/close_holes.h"

namespace tolvol::python {
namespace {

struct HolesClosed {
  py::array_t<std::int32_t> triangles, triangle_loop, borders, corner_source;
  py::list loops;
  py::dict report;
};

HolesClosed close_holes_of_arrays(const py::object& vertices, const py::object& triangles, const Volume& volume,
                                  const py::object& to_world, std::optional<double> largest_perimeter,
                                  std::optional<double> max_normal_angle, const py::object& shares,
                                  std::optional<int> threads, Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  const StoredSpace space(to_matrix(to_world), v.storage);
  CloseHolesOptions options;
  options.largest_perimeter = largest_perimeter;
  options.max_normal_angle = max_normal_angle.value_or(options.max_normal_angle);
  py::array_t<double, py::array::c_style> share_values;
  if (!shares.is_none()) {
    share_values = to_vertex_values<double>(shares, "shares", v.values.size());
    options.shares = {share_values.data(), static_cast<std::size_t>(share_values.size())};
  }
  options.threads = to_threads(threads);
  options.progress = progress;
  HoleClosingResult r;
  {
    const Interruptible call(progress);
    r = close_holes(v.values, t, space, volume.native, options);
  }
  HolesClosed result{from_triangles(r.triangles),
                     from_vector<std::int32_t>(r.loop),
                     from_triangles(r.borders),
                     from_triangles(r.corner_source),
                     py::list(),
                     py::dict()};
  py::dict refused;
  for (const HoleClosingResult::Loop& loop : r.loops) {
    const py::str outcome(name_of(loop.outcome));
    py::dict entry;
    entry["outcome"] = outcome;
    entry["vertex"] = loop.vertex;
    entry["corners"] = loop.corners;
    entry["perimeter"] = loop.perimeter;
    entry["centre"] = py::make_tuple(loop.centre.x, loop.centre.y, loop.centre.z);
    result.loops.append(entry);
    if (loop.outcome != LoopOutcome::closed) {
      refused[outcome] = refused.contains(outcome) ? refused[outcome].cast<std::size_t>() + 1 : std::size_t{1};
    }
  }
  result.report["closed"] = r.count(LoopOutcome::closed);
  result.report["refused"] = refused;
  result.report["triangles_added"] = r.loop.size();
  result.report["warnings"] = r.warnings;
  return result;
}

}  // namespace

void bind_repair(py::module_& module) {
  py::class_<HolesClosed>(module, "HoleClosingResult", py::module_local(),
                          "The triangles that close_holes returns, and what became of each boundary loop.")
      .def_readonly("triangles", &HolesClosed::triangles,
                    "(m + k, 3) int32: the triangles of the input, and after them the new ones, loop by loop.")
      .def_readonly("triangle_loop", &HolesClosed::triangle_loop,
                    "(k,) int32: for each new triangle, the index of its loop in `loops`.")
      .def_readonly("borders", &HolesClosed::borders,
                    "(k, 3) int32: for each side of each new triangle, from corner j to the next, the triangle of the "
                    "input on its other side; -1 where a new triangle is there.")
      .def_readonly("corner_source", &HolesClosed::corner_source,
                    "(k, 3) int32: for each corner of each new triangle, a corner at the rim of the hole, as 3 * "
                    "triangle + corner, from which attributes may be taken. It is a corner of a triangle in `borders` "
                    "where one is at this corner.")
      .def_readonly("loops", &HolesClosed::loops, R"doc(A list with a dict for each boundary loop:

outcome : "closed", or the reason why the loop is left open:

    - "not_a_loop": the open edges end at triangles of the other orientation or at an edge of more than two triangles
    - "too_long": it has more than 1,000 corners
    - "perimeter": it is longer than largest_perimeter
    - "outside": it is not proved that the triangles would be within the tolerance
    - "turned": the triangles would be turned away from the reference, or rounding could turn them
    - "crossing": the triangles would cross others
    - "non_manifold": an edge would be one of more than two triangles
    - "degenerate": the triangles would be segments
    - "given_up": the search ended at one of its limits, so that there may be a filling

    If several of "outside", "turned" and "crossing" apply, it is the one that refused most of the triangles and edges
    that the last search tried. "non_manifold" and "degenerate" are named only if none of these three applies.
vertex : the vertex at which the loop begins, an index
corners : the number of its edges
perimeter : its length in world units
centre : the mean of its corners, (x, y, z) in the world)doc")
      .def_readonly("report", &HolesClosed::report, R"doc(A dict with these entries:

closed : the number of loops that were closed
refused : a dict of the number of other loops for each reason
triangles_added : the number of new triangles
warnings : a list of sentences)doc");
  module.def("close_holes", &close_holes_of_arrays, py::arg("vertices"), py::arg("triangles"), py::arg("volume"),
             py::kw_only(), py::arg("to_world") = py::none(), py::arg("largest_perimeter") = py::none(),
             py::arg("max_normal_angle") = py::none(), py::arg("shares") = py::none(), py::arg("threads") = py::none(),
             py::arg("progress") = py::none(),
             R"doc(Fill the holes of a mesh that can be filled within the tolerance.

A hole is closed by triangles between the vertices of its rim: no vertex is added or moved, and triangle i of the input
stays triangle i. Every point of a new triangle is within the tolerance of the reference. Because the input stays, the
reference is as near to the result as to the input. A new triangle crosses no other, is not degenerate, gives no edge
more than two triangles, and has the orientation of the rim. A hole is filled as a whole or not at all.

To decimate the closed mesh, hand it to decimate with the same volume. The tolerance then still refers to the mesh with
its holes::

    volume = tolvol.ToleranceVolume(vertices, triangles, tolerance)
    closed = tolvol.close_holes(vertices, triangles, volume)
    result = tolvol.decimate(vertices, closed.triangles, volume)

If you give wedges to decimate, give labels of their own to the new triangles of a hole at which islands meet. Otherwise
the islands become one.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
triangles : (m, 3) integer array
volume : ToleranceVolume
largest_perimeter : float, optional
    Leave longer loops open, in world units. The ends of a tube thinner than the tolerance are holes like others.
max_normal_angle : float, optional
    Degrees, more than 0 and at most 180: every point of a new triangle has a point of the reference within the
    tolerance where the normals of both differ by at most this angle. The default, 120, closes the ends of tubes, which
    are at right angles to the tubes, but no sheet by a second one on its back. 180 permits any angle. The default of
    decimate is 90: it counts new triangles with a larger angle among those that exceed it, and keeps their angle.
shares : (n,) float64 array, optional
    For each vertex, from 0 to 1: a new triangle stays within the least share of the tolerance of its corners, and there
    is none at a vertex of share 0.
to_world, threads, progress
    See help(tolvol).

Returns
-------
HoleClosingResult

Raises
------
InvalidInput
    If the mesh or an option is not valid, or if the stored type cannot hold the tolerance.
Cancelled

Notes
-----
An edge is open if it is the edge of one triangle only. Vertices at the same position count as one, so that seams
between vertices at one place are no holes. A triangle that repeats another one does not count. Where several holes meet
at a vertex, each is a loop of its own: the order of the triangles around the mean normal of the vertex decides. Loops
are filled as if they were alone. A loop whose triangles are in conflict with those of a loop before it is then filled
anew around those, if possible.

Of all triangulations whose triangles keep the bounds one by one, the one with the least sum of area times squared sides
is taken. In a plane this is the Delaunay triangulation. Where its triangles cross faces, the next search goes around
these faces. Where two of its triangles cross each other, or lie on one edge, the next search leaves one of them out. A
loop is searched at most 40 times, and one of more than 200 corners 9 times. A loop is given up when 50,000 of its
triangles were refused, or when it has used up its share of the steps that all proofs may take.

Cost: about 1 us a triangle of the mesh. A search takes 5 ms in a loop of 100 corners, and 2 s in one of 1,000, which is
the most. It costs up to 3 s more where most triangles between the corners are refused, as around an island in a hole.
Where proofs are long, as among needles, those of all loops together take up to 8 s, or 1 s a loop if that is more.)doc");
}

}  // namespace tolvol::python
