// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <array>
#include <chrono>

#include "base/errors.h"
#include "decimation/decimation.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"
#include "topology/wedges.h"

namespace tolvol::python {
namespace {

struct Decimated {
  py::array vertices;
  py::array_t<std::int32_t> triangles, vertex_map, vertex_source, triangle_source, source_triangle;
  py::array_t<double> source_weights;
  py::dict report;
};

template <class Enum>
Enum choose(const std::string& value, const char* name, const char* first, Enum first_value, const char* second,
            Enum second_value) {
  if (value == first) return first_value;
  if (value == second) return second_value;
  throw InvalidInput(std::string(name) + " must be \"" + first + "\" or \"" + second + "\", not \"" + value + "\"");
}

py::dict make_report(const DecimationResult& r, std::size_t triangles_in, double seconds) {
  py::dict report, locked;
  py::list repairs;
  for (const Repair& repair : r.repairs) {
    py::dict entry;
    entry["kind"] = repair.kind, entry["count"] = repair.count, entry["message"] = repair.message;
    repairs.append(entry);
  }
  for (const auto& [cause, count] : r.locked) locked[py::str(cause)] = count;
  report["triangles_in"] = triangles_in;
  report["triangles_out"] = r.triangles.size();
  report["seconds"] = seconds;
  report["stopped_by"] = r.stopped_at_target    ? "target"
                         : r.stopped_at_time    ? "time"
                         : r.stopped_on_request ? "request"
                                                : "tolerance";
  report["method"] = r.method;
  report["renderer"] = r.renderer;
  report["repairs"] = repairs;
  report["locked"] = locked;
  report["outside"] = from_outside(r.outside, r.uncovered);
  report["normals"] = from_normals(r.normals);
  report["warnings"] = r.warnings;
  return report;
}

/// Gives back the memory of so many triangles' state, which is free: many small blocks, of which the allocator of the
/// GNU C library would keep several hundred bytes for each triangle.
void return_free_memory([[maybe_unused]] std::size_t triangles) {
#ifdef __GLIBC__
  constexpr std::size_t kMany = 1 << 16;
  if (triangles >= kMany) malloc_trim(0);
#endif
}

Box to_box(const std::array<std::array<double, 3>, 2>& ends) {
  const auto& [l, u] = ends;
  if (!(l[0] < u[0] && l[1] < u[1] && l[2] < u[2])) {
    throw InvalidInput(
        "cell must be a lower and an upper corner, each coordinate of the first below that of the second");
  }
  return {{l[0], l[1], l[2]}, {u[0], u[1], u[2]}};
}

Decimated decimate_arrays(const py::object& vertices, const py::object& triangles, const Volume* volume,
                          const py::object& to_world, const std::string& placement, bool two_sided,
                          std::optional<std::int64_t> target_triangles, const py::object& locked,
                          const py::object& shares, const std::string& outside, const py::object& wedges,
                          const std::string& effort, const std::string& crossings,
                          std::optional<double> max_normal_angle,
                          const std::optional<std::array<std::array<double, 3>, 2>>& cell,
                          std::optional<double> max_seconds, std::optional<int> threads, Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  const StoredSpace space(to_matrix(to_world), v.storage);
  DecimationOptions options;
  options.placement = choose(placement, "placement", "optimal", DecimationOptions::Placement::optimal, "subset",
                             DecimationOptions::Placement::subset);
  options.outside = to_outside(outside);
  options.effort = choose(effort, "effort", "fast", DecimationOptions::Effort::fast, "thorough",
                          DecimationOptions::Effort::thorough);
  options.crossings = choose(crossings, "crossings", "keep_out", DecimationOptions::Crossings::keep_out, "allow",
                             DecimationOptions::Crossings::allow);
  options.max_normal_angle = max_normal_angle.value_or(options.max_normal_angle);
  if (max_seconds && !(*max_seconds > 0)) throw InvalidInput("max_seconds must be positive, or None for no limit");
  options.max_seconds = max_seconds.value_or(0);
  options.two_sided = two_sided;
  if (cell) options.cell = to_box(*cell);
  if (target_triangles && *target_triangles < 1) {
    throw InvalidInput("target_triangles must be at least 1, or None for as few as the tolerance permits");
  }
  options.target_triangles = static_cast<std::size_t>(target_triangles.value_or(0));
  py::array_t<bool, py::array::c_style> locked_values;
  if (!locked.is_none()) {
    locked_values = to_vertex_values<bool>(locked, "locked", v.values.size());
    options.locked = {locked_values.data(), static_cast<std::size_t>(locked_values.size())};
  }
  py::array_t<double, py::array::c_style> share_values;
  if (!shares.is_none()) {
    share_values = to_vertex_values<double>(shares, "shares", v.values.size());
    options.shares = {share_values.data(), static_cast<std::size_t>(share_values.size())};
  }
  std::vector<std::uint32_t> labels;
  if (!wedges.is_none()) {
    for (const glm::uvec3& w : to_triangles(wedges, "wedges")) labels.insert(labels.end(), {w.x, w.y, w.z});
    options.wedges = labels;
  }
  options.threads = to_threads(threads);
  options.progress = progress;

  DecimationResult r;
  double seconds = 0;
  {
    const Interruptible call(progress);
    const auto start = std::chrono::steady_clock::now();
    r = decimate(v.values, t, space, volume ? &volume->native : nullptr, options);
    return_free_memory(t.size());
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  Decimated result;
  result.vertices = from_vertices(r.vertices, v.storage);
  result.triangles = from_triangles(r.triangles);
  result.vertex_map = from_vector<std::int32_t>(r.vertex_map);
  result.vertex_source = from_vector<std::int32_t>(r.vertex_source);
  result.triangle_source = from_vector<std::int32_t>(r.triangle_source);
  result.source_triangle = from_triangles(r.source_triangle);
  result.source_weights =
      py::array_t<double>({static_cast<py::ssize_t>(r.triangles.size()), py::ssize_t{3}, py::ssize_t{3}});
  auto weights = result.source_weights.mutable_unchecked<3>();
  for (std::size_t i = 0; i < r.source_weights.size(); ++i) {
    for (int corner = 0; corner < 3; ++corner) {
      for (int k = 0; k < 3; ++k) weights(static_cast<py::ssize_t>(i), corner, k) = r.source_weights[i][corner][k];
    }
  }
  result.report = make_report(r, t.size(), seconds);
  return result;
}

py::array_t<std::int32_t> wedges(const py::object& triangles, const py::object& corners) {
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  if (!py::isinstance<py::array>(corners)) throw InvalidInput("corners must be a NumPy array, (m, 3, k) float32");
  const py::array_t<float, py::array::c_style | py::array::forcecast> values(corners);
  if (values.ndim() != 3 || static_cast<std::size_t>(values.shape(0)) != t.size() || values.shape(1) != 3) {
    throw InvalidInput("corners must have shape (m, 3, k) with one row for each triangle");
  }
  const std::size_t width = static_cast<std::size_t>(values.shape(2));
  const std::vector<std::uint32_t> labels =
      wedge_labels(t, {values.data(), static_cast<std::size_t>(values.size())}, width);
  return from_vector<std::int32_t>(labels).reshape({static_cast<py::ssize_t>(t.size()), py::ssize_t{3}});
}

}  // namespace

void bind_decimation(py::module_& module) {
  py::class_<Decimated>(module, "DecimationResult", py::module_local(),
                        "The mesh that decimate returns, and where each part of it came from.")
      .def_readonly("vertices", &Decimated::vertices, "(k, 3) array of the input's dtype: local coordinates.")
      .def_readonly("triangles", &Decimated::triangles, "(l, 3) int32: indices of `vertices`.")
      .def_readonly("vertex_map", &Decimated::vertex_map,
                    "(n,) int32: the result vertex that each input vertex was merged into, or -1 if no triangle uses "
                    "it.")
      .def_readonly("vertex_source", &Decimated::vertex_source,
                    "(k,) int32: the input vertex that each result vertex continues. Where sheets touch, the result "
                    "vertex may be where another input vertex was, even with placement=\"subset\".")
      .def_readonly("triangle_source", &Decimated::triangle_source,
                    R"doc((l,) int32: the input triangle that each result triangle continues.

The corners of a result triangle are vertex_map of the corners of that input triangle, in order, unless edges around it
were flipped, or the triangle was divided where vertices lie on it (a T-junction).)doc")
      .def_readonly("source_triangle", &Decimated::source_triangle,
                    "(l, 3) int32: for each corner of the result the input triangle that its attributes are read from.")
      .def_readonly("source_weights", &Decimated::source_weights,
                    "(l, 3, 3) float64: for each corner of the result the barycentric weights in that input triangle.")
      .def_readonly("report", &Decimated::report, R"doc(A dict with these entries:

triangles_in, triangles_out : the number of triangles before and after
seconds : the time that the call took
stopped_by : "tolerance", "target", "time" or "request"
method, renderer : which check was used, and what computed it
repairs : a list of dicts with `kind`, `count` and `message`; the kind "T-junction" counts vertices that were put into the
    edges and faces that they lie on, so that the faces that meet there go on to meet, and "double_sheet" faces that lie
    exactly on another face
locked : a dict from a cause to the number of vertices that could not move
outside : a dict of `faces`, the number of input faces that were outside and were kept, `first`, the first of them, and
    `reference_faces`, the number of reference faces that were beyond the tolerance of the input
normals : a dict of `largest`, an upper bound in degrees on the angle between a face of the result and its witnesses, or
    None if no face has an angle; `unsure`, the number of faces without an angle, because they are degenerate or so
    nearly that rounding could turn them; `exceeded_before`, the number of input faces that were not proved to keep
    max_normal_angle; and `exceeded_after`, how many of these are left, for which `largest` does not hold. None where no
    angle was kept
warnings : a list of sentences)doc");

  module.def("decimate", &decimate_arrays, py::arg("vertices"), py::arg("triangles"), py::arg("volume").none(true),
             py::kw_only(), py::arg("to_world") = py::none(), py::arg("placement") = "optimal",
             py::arg("two_sided") = true, py::arg("target_triangles") = py::none(), py::arg("locked") = py::none(),
             py::arg("shares") = py::none(), py::arg("outside") = "error", py::arg("wedges") = py::none(),
             py::arg("effort") = "fast", py::arg("crossings") = "keep_out", py::arg("max_normal_angle") = py::none(),
             py::arg("cell") = py::none(), py::arg("max_seconds") = py::none(), py::arg("threads") = py::none(),
             py::arg("progress") = py::none(),
             R"doc(Reduce a mesh to few triangles within the tolerance of a volume.

Every point of the result is within the tolerance of the reference and, with two_sided, every point of the reference is
within the tolerance of the result. Both are proved.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
triangles : (m, 3) integer array
volume : ToleranceVolume or None
    None decimates without a tolerance, for comparison. This needs target_triangles.
placement : {"optimal", "subset"}
    "optimal" leaves the fewest triangles. With "subset" every vertex of the result is where an original one was, bit
    for bit.
two_sided : bool
    Whether the reference, too, is kept within the tolerance of the result. If not, parts of it may be lost, but the
    boundary of the result and that of the reference are within the tolerance of each other. An open edge that lies on
    edges of other triangles is no boundary.
target_triangles : int, optional
    Stop at this many triangles, if the tolerance permits so few. None goes on to as few as it permits.
locked : (n,) bool array, optional
    Vertices that neither move nor vanish. An edge between two of them stays.
shares : (n,) float64 array, optional
    From 0 to 1: the share of the tolerance that the new faces around a vertex may use. A face that is there already when
    a vertex of a smaller share becomes one with a corner of it, and that does not change by that, may keep what it uses.
outside : {"error", "keep"}
    What happens if input faces are not within the tolerance: an error, or they stay as they are.
wedges : (m, 3) integer array, optional
    Labels of corners, from the function wedges. Seams between corners of different labels are kept.
effort : {"fast", "thorough"}
    "thorough" then collapses further edges and moves all vertices around each together. It leaves a third fewer
    triangles in 5 to 25 times the processor time. A mesh of some hundred triangles may take 75 times as long, and 20
    seconds. Where edges can collapse alone after that, as in parts of slivers, it does all of it again.
crossings : {"keep_out", "allow"}
    Two faces cross if they meet anywhere but in the corners and edges that they share. "keep_out" makes no new
    crossing: each input face is stood for by one face of the result, and two faces of the result cross only if input
    faces that they stand for crossed. So the number of crossing pairs never rises, and a mesh without crossings stays
    without. Sheets that lie exactly on each other are exempt from each other: pairs of their faces may become more, and
    the repair "double_sheet" counts these faces. A face beside a sheet is not exempt, whatever it comes to stand for.
    Crossings are decided exactly, for the coordinates of the result as they are returned; without a volume the option
    is ignored. "allow" takes a tenth to a quarter less time, and leaves fewer triangles of walls that are thinner than
    twice the tolerance.
max_normal_angle : float, optional
    In degrees, more than 0 and at most 180: every point of a face of the result has a witness, a triangle of the
    reference within the tolerance whose normal is within this angle of the face's. None keeps 90: no face is turned
    over. 180 keeps no angle. Ignored without a volume. A connected part of the input that faces against the reference
    is compared by its other side. Where neighbours are oriented against each other, the normals are those of the part
    with one orientation; of a reference that is not the input, they stay as they are. An input face with a larger angle
    is no error: it is counted, and its angle rises by at most a degree above the least that is proved of it, unless it
    faces against all of the reference near it. A face so thin that rounding could turn its normal is no witness and
    has no angle; only a face that was so in the input may be so in the result. If most faces of the reference are so,
    no angle is kept, and a warning says so.
cell : ((float, float, float), (float, float, float)), optional
    The lower and upper corner of a box in local coordinates, which may be infinite. Only faces whose corners are
    strictly inside change, and their corners stay strictly inside. All others stand still and are not certified. Faces
    of the reference that the mesh does not cover are no error. If a piece of such a face may be covered in part, the
    faces of the mesh within the tolerance of this piece stand still. So the cells of a large mesh, which have no inner
    point in common, may be decimated at once, each with all faces whose bounding box meets the cell, and with all faces
    of the reference whose bounding box is within the tolerance of it. The results together are then within the
    tolerance of the whole reference. The reference is within the tolerance of the results if it was within the
    tolerance of the large mesh. No new faces cross. Needs two_sided.
max_seconds : float, optional
    Stop after this time with what is proved by then, which depends on the speed of the machine. The time does not cut
    short the preparation, in which the mesh is set up and the input is certified: about 0.7 us a triangle, and 2 us if
    the input is not the reference itself.
to_world, threads, progress
    See help(tolvol).

Returns
-------
DecimationResult

Raises
------
InvalidInput
    If an argument or the mesh is not valid, if the stored type cannot hold the tolerance, or if the input is outside.
Cancelled

Notes
-----
Cost of "fast" on one thread: 7 to 9 us a triangle at a tolerance of 1 % and 30 to 53 us at 0.1 %, with the grid of the
volume and crossings kept out.

The order of the collapses is that of M. Garland, P. Heckbert, Surface Simplification Using Quadric Error Metrics, 1997.)doc");
  module.def("wedges", &wedges, py::arg("triangles"), py::arg("corners"),
             R"doc(Return labels that tell the corners with different values at one vertex apart.

Two corners have the same label if and only if they are at the same vertex and all their values are equal.

Parameters
----------
triangles : (m, 3) integer array
corners : (m, 3, k) float32 array
    The values of each corner, for example its UV coordinates.

Returns
-------
(m, 3) int32 array

Raises
------
InvalidInput)doc");
}

}  // namespace tolvol::python
