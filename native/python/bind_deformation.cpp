// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <chrono>

#include "base/errors.h"
#include "motion/deformation.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"

namespace tolvol::python {
namespace {

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Returns any array of numbers as float64 in C order.
Doubles to_doubles(const py::object& object, const std::string& name, const std::string& expected) {
  if (!py::isinstance<py::array>(object)) throw InvalidInput(name + " must be a NumPy array, " + expected);
  const char kind = py::reinterpret_borrow<py::array>(object).dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u') throw InvalidInput(name + " must be numbers, " + expected);
  return Doubles(object);
}

struct PythonLattice {
  glm::uvec3 size, degree;
  LatticeDeformation native;
};

unsigned to_unsigned(const py::handle& object, const std::string& name) {
  if (!py::isinstance<py::int_>(object)) throw InvalidInput(name + " must be an integer, or three");
  const auto value = py::cast<std::int64_t>(object);
  if (value < 0 || value > std::numeric_limits<std::int32_t>::max()) {
    throw InvalidInput(name + " is out of range: " + std::to_string(value));
  }
  return static_cast<unsigned>(value);
}

/// Takes one value for all axes, or three values.
glm::uvec3 to_three(const py::object& object, const std::string& name) {
  if (!py::isinstance<py::sequence>(object)) return glm::uvec3(to_unsigned(object, name));
  const auto sequence = py::reinterpret_borrow<py::sequence>(object);
  if (sequence.size() != 3) throw InvalidInput(name + " must be an integer, or three");
  return {to_unsigned(sequence[0], name), to_unsigned(sequence[1], name), to_unsigned(sequence[2], name)};
}

std::unique_ptr<PythonLattice> make_lattice(const py::object& points, const py::object& domain,
                                            const py::object& degree, const py::object& weights,
                                            const py::object& knots) {
  const Doubles p = to_doubles(points, "points", "(nu, nv, nw, 3)");
  if (p.ndim() != 4 || p.shape(3) != 3) throw InvalidInput("points must have shape (nu, nv, nw, 3)");
  Lattice lattice;
  lattice.size = {p.shape(0), p.shape(1), p.shape(2)};
  for (py::ssize_t i = 0; i + 2 < p.size(); i += 3) {
    lattice.points.emplace_back(p.data()[i], p.data()[i + 1], p.data()[i + 2]);
  }
  lattice.domain = to_matrix(domain, "domain");
  lattice.degree =
      degree.is_none() ? glm::min(glm::uvec3(3), glm::max(lattice.size, 2u) - 1u) : to_three(degree, "degree");
  if (!weights.is_none()) {
    const Doubles w = to_doubles(weights, "weights", "(nu, nv, nw)");
    if (w.ndim() != 3 || !std::equal(w.shape(), w.shape() + 3, p.shape())) {
      throw InvalidInput("weights must have one value for each control point, shape (nu, nv, nw)");
    }
    lattice.weights.assign(w.data(), w.data() + w.size());
  }
  if (!knots.is_none()) {
    if (!py::isinstance<py::sequence>(knots) || py::len(knots) != 3) {
      throw InvalidInput("knots must be three: an array or None for each axis");
    }
    const auto three = py::reinterpret_borrow<py::sequence>(knots);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const py::object along = three[axis];
      if (along.is_none()) continue;
      const Doubles k = to_doubles(along, "knots", "(n + degree + 1,)");
      if (k.ndim() != 1 || k.size() == 0) throw InvalidInput("knots must have shape (n + degree + 1,)");
      lattice.knots[axis].assign(k.data(), k.data() + k.size());
    }
  }
  return std::make_unique<PythonLattice>(PythonLattice{lattice.size, lattice.degree, LatticeDeformation(lattice)});
}

Doubles lattice_points(const py::object& shape, const py::object& domain) {
  const glm::uvec3 size = to_three(shape, "shape");
  const std::vector<glm::dvec3> rest = rest_points(size, to_matrix(domain, "domain"));
  Doubles result({py::ssize_t{size.x}, py::ssize_t{size.y}, py::ssize_t{size.z}, py::ssize_t{3}});
  double* out = result.mutable_data();
  for (const glm::dvec3& p : rest) {
    for (int axis = 0; axis < 3; ++axis) *out++ = p[axis];
  }
  return result;
}

struct Deformed {
  py::array vertices;
  py::dict report;
};

DeformationOptions::Mode deformation_mode(const std::string& mode) {
  if (mode == "blocked") return DeformationOptions::Mode::blocked;
  if (mode == "farthest") return DeformationOptions::Mode::farthest;
  if (mode == "pull_back") return DeformationOptions::Mode::pull_back;
  throw InvalidInput("mode must be \"blocked\", \"farthest\" or \"pull_back\", not \"" + mode + "\"");
}

py::dict make_report(const DeformationResult& r, double seconds) {
  const auto counted = [](const FaceCount& count) {
    py::dict entry;
    entry["faces"] = count.faces, entry["first"] = count.first;
    return entry;
  };
  py::dict report;
  report["permitted_fraction"] = r.permitted_fraction;
  report["leaving"] = counted(r.leaving);
  report["turning"] = counted(r.turning);
  report["crossing"] = counted(r.crossing);
  report["outside"] = from_outside(r.outside, r.uncovered);
  report["outside_lattice"] = r.outside_lattice;
  report["moved"] = r.moved;
  report["held_back"] = r.held_back;
  report["kept_from_crossing"] = r.kept_from_crossing;
  report["largest_motion"] = r.largest_motion;
  report["normals"] = from_normals(r.normals);
  report["method"] = r.method;
  report["renderer"] = r.renderer;
  report["seconds"] = seconds;
  report["warnings"] = r.warnings;
  return report;
}

Deformed deform_arrays(const py::object& vertices, const PythonLattice& lattice, const py::object& faces,
                       const Volume* volume, const py::object& to_world, const std::string& mode, bool two_sided,
                       const std::string& outside, const std::string& crossings, std::optional<double> max_normal_angle,
                       std::optional<int> threads, Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  int corners = 3;
  std::vector<std::uint32_t> indices;
  if (!faces.is_none()) indices = to_faces(faces, "faces", corners);
  if (volume && faces.is_none()) throw InvalidInput("with a volume faces are needed, to be kept within it");
  const StoredSpace placed(to_matrix(to_world), v.storage);
  DeformationOptions options;
  options.mode = deformation_mode(mode);
  options.two_sided = two_sided;
  options.outside = to_outside(outside);
  options.crossings = to_crossings(crossings);
  options.max_normal_angle = max_normal_angle.value_or(options.max_normal_angle);
  options.threads = to_threads(threads);
  options.progress = progress;
  DeformationResult r;
  double seconds = 0;
  {
    const Interruptible call(progress);
    const auto start = std::chrono::steady_clock::now();
    r = deform(v.values, indices, corners, placed, volume ? &volume->native : nullptr, lattice.native, options);
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return {from_vertices(r.vertices, v.storage), make_report(r, seconds)};
}

}  // namespace

void bind_deformation(py::module_& module) {
  py::class_<PythonLattice>(module, "Lattice", py::module_local(),
                            R"doc(Control points of a trivariate NURBS function that deforms the space of a box.

At rest the points are the regular grid of the box (see lattice_points). Nothing is then deformed, whatever the degree
and the knots are.)doc")
      .def(py::init(&make_lattice), py::arg("points"), py::arg("domain") = py::none(), py::kw_only(),
           py::arg("degree") = py::none(), py::arg("weights") = py::none(), py::arg("knots") = py::none(),
           R"doc(Make a lattice.

Parameters
----------
points : (nu, nv, nw, 3) array
    Where the control points are now, in world units; at least 2 along each axis.
domain : (4, 4) array, optional
    Maps the unit cube to the box in the world: origin + 3 edges. None is the unit cube.
degree : int or three ints, optional
    From 1 to the number of points less 1, where the functions are Bernstein's; at most 15. None is 3, or as much as the
    points permit.
weights : (nu, nv, nw) array, optional
    Positive weights of the control points. None makes all equal.
knots : three arrays or Nones, optional
    For each axis (points + degree + 1,) values, clamped, or None for uniform knots.

Raises
------
InvalidInput

References
----------
T. W. Sederberg, S. R. Parry, Free-form deformation of solid geometric models, 1986.
L. Piegl, W. Tiller, The NURBS Book, 1997.)doc")
      .def_property_readonly(
          "shape", [](const PythonLattice& l) { return py::make_tuple(l.size.x, l.size.y, l.size.z); },
          "The number of control points along each axis.")
      .def_property_readonly(
          "degree", [](const PythonLattice& l) { return py::make_tuple(l.degree.x, l.degree.y, l.degree.z); },
          "The degree along each axis.");

  module.def("lattice_points", &lattice_points, py::arg("shape"), py::arg("domain") = py::none(),
             R"doc(Return the control points of a Lattice at rest.

Parameters
----------
shape : int or three ints
    The number of points along each axis, at least 2.
domain : (4, 4) array, optional
    As for Lattice.

Returns
-------
(nu, nv, nw, 3) float64 array
    World units.

Raises
------
InvalidInput)doc");

  py::class_<Deformed>(module, "DeformationResult", py::module_local(), "The mesh that deform returns.")
      .def_readonly("vertices", &Deformed::vertices, "(n, 3) array of the input's dtype: local coordinates.")
      .def_readonly("report", &Deformed::report, R"doc(A dict with these entries:

permitted_fraction : from 0 to 1, the share of the way at which the whole mesh is certified to be inside, and no faces
    are turned or cross that must not, found by bisection to a thousandth; 1 without a volume; None if vertices were
    pulled back instead
leaving : a dict of `faces`, the number of faces that the deformation as wished would not leave certified inside, and
    `first`, the first of them. If there are none, some that it would take from a part of the reference that has no
    other face within the tolerance
turning : the same for faces that would exceed max_normal_angle, and did not before; it is only looked for if no faces
    are leaving
crossing : the same for faces that would cross others or become degenerate, and did not before; it is only looked for if
    no faces are leaving or turning
outside : a dict of `faces`, the number of faces that were outside before and were kept, `first`, the first of them, and
    `reference_faces`, the number of reference faces that were beyond the tolerance of the mesh before
outside_lattice : the number of vertices that are not in the box
moved : the number of vertices of the result that are not where they were
normals : how the faces of the result face the reference, as in the report of decimate
held_back : the number of vertices of the result that are not where they were to go
kept_from_crossing : the number of these that went back so that no faces cross, if vertices were pulled back
largest_motion : the longest way of a vertex, in world units
method, renderer : which check was used, and what computed it
seconds : the time that the call took
warnings : a list of sentences)doc");

  module.def("deform", &deform_arrays, py::arg("vertices"), py::arg("lattice"), py::arg("faces") = py::none(),
             py::arg("volume").none(true) = py::none(), py::kw_only(), py::arg("to_world") = py::none(),
             py::arg("mode") = "blocked", py::arg("two_sided") = true, py::arg("outside") = "error",
             py::arg("crossings") = "keep_out", py::arg("max_normal_angle") = py::none(),
             py::arg("threads") = py::none(), py::arg("progress") = py::none(),
             R"doc(Deform the space in the box of a lattice, and with it a mesh, within the tolerance of a volume.

Vertices outside of the box stay where they are.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
lattice : Lattice
faces : (m, k) integer array, optional
    k is 1 (points), 2 (segments), 3 (triangles) or 4 (quads, which keep the tolerance in every triangulation). A
    triangle among quads repeats a corner that is next to itself, as in (a, b, c, c). With a volume the faces are needed.
volume : ToleranceVolume, optional
    The result has to stay in it.
mode : {"blocked", "farthest", "pull_back"}
    What happens to a deformation that is not certified inside as a whole, or by which faces would turn or cross.
    "blocked" moves nothing, and the report says how far the deformation may go. "farthest" moves every vertex that
    permitted share of its way. "pull_back" moves each vertex as far as it may go, as constrain does. Vertices that
    hold T-junctions together stay, as in constrain; they move only with a mesh that is beyond the tolerance before the
    deformation and is brought within it as a whole.
two_sided, outside
    As for constrain. A mesh that is beyond the tolerance before the deformation is no error if it is within it
    afterwards and no faces turn or cross that must not.
crossings : {"keep_out", "allow"}
    As for constrain. Without a volume nothing is held back.
max_normal_angle
    As for constrain. Ignored without a volume.
to_world, threads, progress
    See help(tolvol).

Returns
-------
DeformationResult

Raises
------
InvalidInput
    If an argument is not valid, if the stored type cannot hold the tolerance, or if the mesh is beyond the tolerance
    before.
Cancelled

Notes
-----
Cost: about 0.4 us a vertex, with a volume one check and 1 us a vertex, and two-sided 2 us a face of the reference. If
the check fails: some twelve checks, or constrain.

After M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 5.)doc");
}

}  // namespace tolvol::python
