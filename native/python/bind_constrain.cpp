// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <mutex>

#include "base/errors.h"
#include "motion/constrain.h"
#include "motion/guard.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"

namespace tolvol::python {
namespace {

struct Constrained {
  py::array vertices;
  py::array_t<double> factors;
  py::dict report;
};

PullBack::Mode pull_back_mode(const std::string& mode) {
  if (mode == "pull_back") return PullBack::Mode::pull_back;
  if (mode == "reset") return PullBack::Mode::reset;
  throw InvalidInput("mode must be \"pull_back\" or \"reset\", not \"" + mode + "\"");
}

Constrained constrain_arrays(const py::object& before, const py::object& after, const py::object& faces,
                             const Volume& volume, const py::object& to_world, const std::string& mode, bool two_sided,
                             const std::string& outside, const std::string& crossings,
                             std::optional<double> max_normal_angle, std::optional<int> threads, Progress* progress) {
  const Vertices from = to_vertices(before, "before"), to = to_vertices(after, "after");
  if (from.storage != to.storage) throw InvalidInput("before and after must have the same type");
  int corners = 3;
  const std::vector<std::uint32_t> indices = to_faces(faces, "faces", corners);
  const StoredSpace space(to_matrix(to_world), from.storage);
  ConstrainOptions options;
  options.mode = pull_back_mode(mode);
  options.two_sided = two_sided;
  options.outside = to_outside(outside);
  options.crossings = to_crossings(crossings);
  options.max_normal_angle = max_normal_angle.value_or(options.max_normal_angle);
  options.threads = to_threads(threads);
  options.progress = progress;
  ConstrainResult r;
  {
    const Interruptible call(progress);
    r = constrain(from.values, to.values, indices, corners, space, volume.native, options);
  }
  Constrained result{from_vertices(r.vertices, from.storage), from_vector<double>(r.factors), {}};
  result.report["held_back"] = r.held_back;
  result.report["kept_from_crossing"] = r.kept_from_crossing;
  result.report["outside"] = from_outside(r.outside, r.uncovered);
  result.report["normals"] = from_normals(r.normals);
  result.report["method"] = r.method;
  result.report["renderer"] = r.renderer;
  result.report["warnings"] = r.warnings;
  return result;
}

/// An (n, 3) float32 array in C order. to_positions() copies an array only if it is in another order.
using Positions = py::array_t<float, py::array::c_style>;

Positions to_positions(const py::object& array) {
  if (!py::isinstance<py::array_t<float>>(array)) {
    throw InvalidInput("positions must be a NumPy array, (n, 3) float32");
  }
  Positions positions(py::reinterpret_borrow<py::array>(array));
  if (positions.ndim() != 2 || positions.shape(1) != 3) throw InvalidInput("positions must have shape (n, 3)");
  return positions;
}

std::span<const float> values(const Positions& positions) {
  return {positions.data(), static_cast<std::size_t>(positions.size())};
}

/// The Python class Guard holds this; two threads take turns.
struct LockedGuard {
  Guard native;
  std::mutex mutex;
};

std::unique_ptr<LockedGuard> make_guard(const py::object& positions, const py::object& faces, const Volume& volume,
                                        const py::object& to_world, bool two_sided, const std::string& outside,
                                        const std::string& crossings, std::optional<double> max_normal_angle,
                                        std::optional<int> threads, Progress* progress) {
  const Positions p = to_positions(positions);
  int corners = 3;
  std::vector<std::uint32_t> indices = to_faces(faces, "faces", corners);
  const glm::dmat4 matrix = to_matrix(to_world);
  Guard::Options options;
  options.outside = to_outside(outside), options.two_sided = two_sided;
  options.crossings = to_crossings(crossings);
  options.max_normal_angle = max_normal_angle.value_or(options.max_normal_angle);
  options.threads = to_threads(threads), options.progress = progress;
  const Interruptible call(progress);
  return std::unique_ptr<LockedGuard>(
      new LockedGuard{{values(p), std::move(indices), corners, matrix, volume.native, options}, {}});
}

py::tuple guard_constrain(LockedGuard& guard, const py::object& positions, Progress* progress) {
  const Positions p = to_positions(positions);
  Guard::Correction correction;
  {
    const Interruptible call(progress);
    const std::lock_guard lock(guard.mutex);
    correction = guard.native.constrain(values(p));
  }
  py::array_t<float> moved({static_cast<py::ssize_t>(correction.vertices.size()), py::ssize_t{3}});
  std::copy(correction.positions.begin(), correction.positions.end(), moved.mutable_data());
  return py::make_tuple(from_vector<std::int32_t>(correction.vertices), moved);
}

void guard_reset(LockedGuard& guard, const py::object& positions, Progress* progress) {
  const Positions p = to_positions(positions);
  const Interruptible call(progress);
  const std::lock_guard lock(guard.mutex);
  guard.native.reset(values(p), progress);
}

py::array_t<std::int32_t> guard_replace_faces(LockedGuard& guard, const py::object& faces, Progress* progress) {
  int corners = 3;
  std::vector<std::uint32_t> indices = to_faces(faces, "faces", corners);
  if (corners != guard.native.corners()) {
    throw InvalidInput("the faces of the guard have " + std::to_string(guard.native.corners()) + " corners, not " +
                       std::to_string(corners));
  }
  std::vector<std::uint32_t> refused;
  {
    const Interruptible call(progress);
    const std::lock_guard lock(guard.mutex);
    refused = guard.native.replace_faces(std::move(indices), progress);
  }
  return from_vector<std::int32_t>(refused);
}

}  // namespace

void bind_constrain(py::module_& module) {
  py::class_<Constrained>(module, "ConstrainResult", py::module_local(),
                          "The mesh that constrain returns, and how far each vertex went.")
      .def_readonly("vertices", &Constrained::vertices, "(n, 3) array of the input's dtype: local coordinates.")
      .def_readonly("factors", &Constrained::factors,
                    "(n,) float64: the share of its motion that each vertex went, from 0 to 1.")
      .def_readonly("report", &Constrained::report, R"doc(A dict with these entries:

held_back : the number of vertices that did not go all the way
kept_from_crossing : the number of these that went back so that no faces cross
outside : a dict of `faces`, the number of faces that were outside before and were kept, `first`, the first of them, and
    `reference_faces`, the number of reference faces that were beyond the tolerance of the mesh before
normals : how the faces of the result face the reference, as in the report of decimate
method, renderer : which check was used, and what computed it
warnings : a list of sentences)doc");
  module.def("constrain", &constrain_arrays, py::arg("before"), py::arg("after"), py::arg("faces"), py::arg("volume"),
             py::kw_only(), py::arg("to_world") = py::none(), py::arg("mode") = "pull_back",
             py::arg("two_sided") = true, py::arg("outside") = "error", py::arg("crossings") = "keep_out",
             py::arg("max_normal_angle") = py::none(), py::arg("threads") = py::none(),
             py::arg("progress") = py::none(),
             R"doc(Move the vertices of a mesh as far as the tolerance permits.

Vertex v ends at before + f (after - before), rounded to the stored type, where f is its factor. All faces of the result
are inside the volume, also where the factors of their corners differ, and every point of the reference is within the
tolerance of the result. Vertices at one place in both arrays have one factor. What holds a T-junction together, where a
vertex lies on an open edge or, at an open edge itself, on another edge or the inside of a face, stays; a warning counts
it. Any other vertex ends exactly at `after`, bit for bit, if neither it nor a vertex at its place touches a face that
failed.

Parameters
----------
before, after : (n, 3) arrays, both float32 or both float64
    Local coordinates before the motion and as they are wished.
faces : (m, k) integer array
    k is 1 (points), 2 (segments), 3 (triangles) or 4 (quads). A triangle among quads repeats a corner that is next to
    itself, as in (a, b, c, c). Quads keep the tolerance in every triangulation, and the reference keeps it whether all
    quads are cut from their first corner to the third, or all along the other diagonal.
volume : ToleranceVolume
mode : {"pull_back", "reset"}
    "pull_back" goes so far that no single factor can rise by 1/64 alone. Two-sided, it lowers factors by at least 1/16
    of themselves where the reference would lose its last face within the tolerance, and so it does where faces would
    cross. With "reset" each factor is 0 or 1.
two_sided : bool
    False keeps the distance from the mesh to the reference alone: parts of the reference may be farther from the mesh.
    It must be False for points and segments.
outside : {"error", "keep"}
    What happens if the mesh is beyond the tolerance before the motion: an error, or the vertices of faces that are
    outside and of those nearest to uncovered faces of the reference stay where they are.
crossings : {"keep_out", "allow"}
    "keep_out" also holds vertices back where faces would come to cross. Two faces cross where they meet anywhere but in
    the corners and edges that they share, decided exactly for the stored coordinates; they may cross only if they cross
    in `before`. No face becomes degenerate, either. Of quads this holds in every triangulation. Vertices go back by at
    least 1/16 of their way then.
max_normal_angle : float, optional
    In degrees, more than 0 and at most 180: every point of a face keeps a witness, a triangle of the reference within
    the tolerance whose normal is within this angle of the face's. None keeps 90: no face is turned over. 180 keeps no
    angle. What is said of input faces, orientation and thin faces in decimate holds here, too.
to_world, threads, progress
    See help(tolvol).

Returns
-------
ConstrainResult

Raises
------
InvalidInput
    If an array is not valid, if the stored type cannot hold the tolerance, or if the mesh is beyond the tolerance
    before the motion.
Cancelled

Notes
-----
Cost: about 1 us a vertex and 2 us a face of the reference to certify the mesh before the motion. Each vertex that is
held back costs 2 to 20 us if its neighbours move like it over a smooth reference. It costs 50 to 800 us if the
reference is rough, if each vertex is pushed in a direction of its own by several tolerances, or if it is at the
tolerance already, as in a loop that pushes on. Keeping crossings out costs 1 us for each triangle that moves, and 5 us
for each quad. Among large triangles that run through each other a search looks at a share of them all: with 3,000
random ones a vertex that is held back costs 0.7 ms.

"reset" is from M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 5.)doc");

  py::class_<LockedGuard>(module, "Guard", py::module_local(),
                          R"doc(Keeps a mesh that is edited step by step inside a volume, as constrain does.

An edit costs a comparison of all positions with the last ones and what it touches: about 1 ms for 1,000 of a million
vertices, and for each vertex that is held back as much as in constrain.)doc")
      .def(py::init(&make_guard), py::arg("positions"), py::arg("faces"), py::arg("volume"), py::kw_only(),
           py::arg("to_world") = py::none(), py::arg("two_sided") = true, py::arg("outside") = "error",
           py::arg("crossings") = "allow", py::arg("max_normal_angle") = py::none(), py::arg("threads") = py::none(),
           py::arg("progress") = py::none(), py::keep_alive<1, 4>(),
           R"doc(Start from these positions.

Parameters
----------
positions : (n, 3) float32 array
    Local coordinates.
faces, volume, two_sided, outside, max_normal_angle
    As for constrain.
crossings : {"allow", "keep_out"}
    As for constrain. Faces may cross only if they crossed at the start.
to_world, threads, progress
    See help(tolvol). The progress is that of this call alone.

Raises
------
InvalidInput
    As constrain does.
Cancelled

Notes
-----
Cost: about 1 us a vertex and 2 us a face of the reference.)doc")
      .def("constrain", &guard_constrain, py::arg("positions"), py::kw_only(), py::arg("progress") = py::none(),
           R"doc(Take the mesh as it was edited since the last call, and return the vertices that have to go back.

Write the returned positions before the next call. All other vertices stay as they came, bit for bit. Undo is an edit
like any other.

Parameters
----------
positions : (n, 3) float32 array
    It is not copied if it is contiguous.
progress : Progress, optional

Returns
-------
indices : (k,) int32 array
positions : (k, 3) float32 array

Raises
------
InvalidInput
    If the number of vertices differs, or if a vertex that moved is not finite. The guard keeps its state.
Cancelled
    The guard keeps its state.)doc")
      .def("reset", &guard_reset, py::arg("positions"), py::kw_only(), py::arg("progress") = py::none(),
           R"doc(Start anew from these positions.

Raises
------
InvalidInput
    As the constructor does. The guard keeps its state.
Cancelled
    The guard keeps its state.

Notes
-----
Cost: about 1 us a vertex and 2 us a face of the reference.)doc")
      .def("replace_faces", &guard_replace_faces, py::arg("faces"), py::kw_only(), py::arg("progress") = py::none(),
           R"doc(Take other faces on the same vertices, where polygons are triangulated in another way now.

Parameters
----------
faces : integer array
    As many faces as before, with as many corners. Each repeats the same corners as before, if any.
progress : Progress, optional

Returns
-------
(k,) int32 array
    Those of the faces that differ that the guard cannot take: which are outside, exceed max_normal_angle, cross
    another face, unless faces may cross, or leave a part of the reference beyond the tolerance of the mesh; and those
    that would replace a face that since the start has been outside, beyond max_normal_angle, without area or nearest to
    an uncovered face of the reference. The guard takes the faces only if there are none.

Raises
------
InvalidInput
    If the array is not valid. The guard keeps its faces.
Cancelled
    The guard keeps its faces.

Notes
-----
Cost: about 50 ns a face, and for each face that differs as much as making a guard.)doc")
      .def_property_readonly(
          "vertex_count", [](const LockedGuard& guard) { return guard.native.vertex_count(); },
          "The number of vertices.")
      .def_property_readonly(
          "outside", [](const LockedGuard& guard) { return from_vector<std::int32_t>(guard.native.start().outside); },
          "(k,) int32: the faces that were outside at the start. Their vertices never move.")
      .def_property_readonly(
          "uncovered", [](const LockedGuard& guard) { return guard.native.start().uncovered.faces; },
          "The number of reference faces that were beyond the tolerance of the mesh at the start. The vertices nearest "
          "to them never move.")
      .def_property_readonly(
          "exceeding", [](const LockedGuard& guard) { return guard.native.start().exceeding.size(); },
          "The number of faces that were not proved to keep max_normal_angle at the start. They keep the angle of "
          "the start, or a smaller one.")
      .def_property_readonly(
          "warnings", [](const LockedGuard& guard) { return guard.native.start().warnings; },
          "A list of sentences about the start.");
}

}  // namespace tolvol::python
