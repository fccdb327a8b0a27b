// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <chrono>

#include "base/errors.h"
#include "motion/smoothing.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"

namespace tolvol::python {
namespace {

struct Smoothed {
  py::array vertices;
  py::dict report;
};

/// Returns the index of `value` among the two values.
bool is_second(const std::string& value, const char* name, const char* first, const char* second) {
  if (value != first && value != second) {
    throw InvalidInput(std::string(name) + " must be \"" + first + "\" or \"" + second + "\", not \"" + value + "\"");
  }
  return value == second;
}

Smoothed smooth_arrays(const py::object& vertices, const py::object& triangles, const Volume* volume,
                       const py::object& to_world, std::int64_t iterations, const std::string& kind,
                       const std::string& weights, const std::string& boundary, const py::object& locked,
                       const py::object& strength, const std::string& mode, bool two_sided, const std::string& outside,
                       const std::string& crossings, std::optional<double> max_normal_angle, std::optional<int> threads,
                       Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  const StoredSpace space(to_matrix(to_world), v.storage);
  using Options = SmoothingOptions;
  Options options;
  if (iterations < 0 || iterations > std::numeric_limits<int>::max()) {
    throw InvalidInput("iterations must be from 0 to 2^31 - 1, not " + std::to_string(iterations));
  }
  options.iterations = static_cast<unsigned>(iterations);
  options.kind = is_second(kind, "operator", "laplacian", "bilaplacian") ? Options::Operator::bilaplacian
                                                                         : Options::Operator::laplacian;
  options.weights =
      is_second(weights, "weights", "uniform", "cotangent") ? Options::Weights::cotangent : Options::Weights::uniform;
  options.boundary =
      is_second(boundary, "boundary", "fixed", "along") ? Options::Boundary::along : Options::Boundary::fixed;
  options.reset = is_second(mode, "mode", "pull_back", "reset");
  options.two_sided = two_sided;
  options.outside = to_outside(outside);
  options.crossings = to_crossings(crossings);
  options.max_normal_angle = max_normal_angle.value_or(options.max_normal_angle);
  py::array_t<bool, py::array::c_style> locked_values;
  if (!locked.is_none()) {
    locked_values = to_vertex_values<bool>(locked, "locked", v.values.size());
    options.locked = {locked_values.data(), static_cast<std::size_t>(locked_values.size())};
  }
  py::array_t<double, py::array::c_style> strength_values;
  if (!strength.is_none()) {
    strength_values = to_vertex_values<double>(strength, "strength", v.values.size());
    options.strength = {strength_values.data(), static_cast<std::size_t>(strength_values.size())};
  }
  options.threads = to_threads(threads);
  options.progress = progress;

  SmoothingResult r;
  double seconds = 0;
  {
    const Interruptible call(progress);
    const auto start = std::chrono::steady_clock::now();
    r = smooth(v.values, t, space, volume ? &volume->native : nullptr, options);
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  Smoothed result{from_vertices(r.vertices, v.storage), {}};
  py::dict fixed;
  fixed["boundary"] = r.fixed_boundary;
  fixed["non-manifold"] = r.fixed_non_manifold;
  fixed["T-junction"] = r.fixed_t_junctions;
  result.report["held_back"] = r.held_back;
  result.report["kept_from_crossing"] = r.kept_from_crossing;
  result.report["largest_motion"] = r.largest_motion;
  result.report["welded"] = r.welded;
  result.report["fixed"] = fixed;
  result.report["outside"] = from_outside(r.outside, r.uncovered);
  result.report["normals"] = from_normals(r.normals);
  result.report["method"] = r.method;
  result.report["renderer"] = r.renderer;
  result.report["warnings"] = r.warnings;
  result.report["seconds"] = seconds;
  return result;
}

}  // namespace

void bind_smoothing(py::module_& module) {
  py::class_<Smoothed>(module, "SmoothingResult", py::module_local(), "The mesh that smooth returns.")
      .def_readonly("vertices", &Smoothed::vertices, "(n, 3) array of the input's dtype: local coordinates.")
      .def_readonly("report", &Smoothed::report, R"doc(A dict with these entries:

held_back : for each iteration the number of vertices that did not go all the way
kept_from_crossing : for each iteration the number of these that went back so that no faces cross
largest_motion : the longest way of a vertex from the input to the result, in world units
welded : the number of vertices that were treated as one with an earlier vertex at the same place
fixed : a dict of `boundary`, `non-manifold` and `T-junction`, the number of vertices that stay for that cause
outside : a dict of `faces`, the number of input faces that were outside and were kept, `first`, the first of them, and
    `reference_faces`, the number of reference faces that were beyond the tolerance of the input
normals : how the faces of the result face the reference, as in the report of decimate
method, renderer : which check was used, and what computed it
warnings : a list of sentences
seconds : the time that the call took)doc");
  module.def("smooth", &smooth_arrays, py::arg("vertices"), py::arg("triangles"), py::arg("volume") = py::none(),
             py::kw_only(), py::arg("to_world") = py::none(), py::arg("iterations") = 10,
             py::arg("operator") = "bilaplacian", py::arg("weights") = "cotangent", py::arg("boundary") = "fixed",
             py::arg("locked") = py::none(), py::arg("strength") = py::none(), py::arg("mode") = "pull_back",
             py::arg("two_sided") = true, py::arg("outside") = "error", py::arg("crossings") = "keep_out",
             py::arg("max_normal_angle") = py::none(), py::arg("threads") = py::none(),
             py::arg("progress") = py::none(),
             R"doc(Smooth a mesh within the tolerance of a volume.

Every iteration ends with all faces inside and the whole reference within the tolerance of them. Vertices at an edge
with more than two faces stay where they are, and so does what holds a T-junction together: a vertex of an open edge
that lies on another edge or on the inside of a face, or a vertex inside a sheet that lies on an open edge of
another, and the corners there.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
triangles : (m, 3) integer array
volume : ToleranceVolume, optional
    None smooths without a bound, and holds nothing back.
iterations : int
    0 or more.
operator : {"bilaplacian", "laplacian"}
    "bilaplacian" keeps curvature better.
weights : {"cotangent", "uniform"}
    "cotangent", measured in the world, keeps the shapes of the triangles; "uniform" evens them out.
boundary : {"fixed", "along"}
    Boundary vertices stay where they are, or are smoothed along the boundary.
locked : (n,) bool array, optional
    Vertices that stay where they are.
strength : (n,) float64 array, optional
    From 0 to 1: the share of a full step that each vertex goes.
mode : {"pull_back", "reset"}
    "pull_back" pulls a vertex back along its step where the tolerance, the angle or a crossing asks for it. Its next
    step is then at most twice as long as the way that it went, or a sixteenth of the tolerance if that is more. This
    limit doubles with each iteration in which the vertex is not pulled back. Vertices whose steps are shortened by it
    count in `held_back`, too. "reset" leaves a vertex that would be pulled back where it is for this iteration.
two_sided : bool
    False keeps the distance from the mesh to the reference alone: parts of the reference may be farther from the mesh.
outside : {"error", "keep"}
    What happens if the input is beyond the tolerance: an error, or faces that are outside and those nearest to
    uncovered faces of the reference stay as they are.
crossings : {"keep_out", "allow"}
    "keep_out" also holds vertices back where faces would come to cross that do not cross in the input, as constrain
    does. Without a volume nothing is held back.
max_normal_angle : float, optional
    In degrees, more than 0 and at most 180: every point of a face keeps a witness, a triangle of the reference within
    the tolerance whose normal is within this angle of the face's. None keeps 90: no face is turned over. 180 keeps no
    angle. What is said of input faces, orientation and thin faces in decimate holds here, too. Ignored without a
    volume.
to_world, threads, progress
    See help(tolvol).

Returns
-------
SmoothingResult

Raises
------
InvalidInput
    If an argument or the mesh is not valid, if the stored type cannot hold the tolerance, or if the input is outside.
Cancelled

Notes
-----
Cost: about 0.3 us for each vertex in each iteration, and 30 to 120 us for each vertex that is held back. Two-sided, 2 us
for each face of a reference that is not the input, and 1.1 to 1.3 times as much for each iteration, or more if more
vertices are held back. Keeping crossings out costs 2 us for each triangle, and 3 us in each iteration for each triangle
whose corners came so far that it could cross others: usually a few in a hundred.

After M. Desbrun et al., Implicit Fairing of Irregular Meshes using Diffusion and Curvature Flow, 1999. "reset" is from
M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 5.)doc");
}

}  // namespace tolvol::python
