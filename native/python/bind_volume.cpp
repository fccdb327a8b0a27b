// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/parallel.h"
#include "check/tolerance_volume.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"

namespace tolvol::python {
namespace {

constexpr std::pair<Field, const char*> kFields[] = {
    {Field::scatter, "scatter"}, {Field::gl, "gl"}, {Field::fast_marching, "fast_marching"}};

Field to_field(const std::string& name) {
  std::string names;
  for (const auto& [field, field_name] : kFields) {
    if (name == field_name) return field;
    names += (names.empty() ? "" : ", ") + std::string(field_name);
  }
  throw InvalidInput("unknown field \"" + name + "\"; there are: " + names);
}

const char* name_of(Field field) {
  return std::ranges::find(kFields, field, &std::pair<Field, const char*>::first)->second;
}

std::unique_ptr<Volume> make_volume(const py::object& vertices, const py::object& triangles, double tolerance,
                                    const py::object& to_world, std::optional<double> precision,
                                    std::optional<std::int64_t> grid_memory, const std::string& field,
                                    std::optional<int> threads, Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  const StoredSpace space(to_matrix(to_world), v.storage);
  if (grid_memory && *grid_memory < 0) throw InvalidInput("grid_memory must not be negative");
  ToleranceVolume::Options options{.precision = precision, .threads = to_threads(threads), .progress = progress};
  options.field = to_field(field);
  if (grid_memory) options.grid_memory = std::min(kLargestGrid, static_cast<std::size_t>(*grid_memory));
  const Interruptible call(progress);
  const auto start = std::chrono::steady_clock::now();
  auto volume =
      std::unique_ptr<Volume>(new Volume{{v.values, t, space, tolerance, options}, v.values.size(), t.size()});
  volume->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return volume;
}

struct CheckResult {
  py::array_t<std::uint8_t> verdicts;
  std::string method, renderer;
};

CheckResult check(const Volume& volume, const py::object& points, const py::object& faces, const py::object& to_world,
                  const py::object& groups, const std::string& method, std::optional<int> threads, Progress* progress) {
  const Vertices v = to_vertices(points, "points");
  int corners = 3;
  const std::vector<std::uint32_t> indices = to_faces(faces, "faces", corners);
  const StoredSpace space(to_matrix(to_world), v.storage);
  std::vector<std::int32_t> labels;
  if (!groups.is_none()) labels = to_labels(groups, "groups");
  const ToleranceCheck::Options options{to_threads(threads), progress};
  std::shared_ptr<const ToleranceCheck> by;
  std::vector<Verdict> verdicts;
  {
    const Interruptible call(progress);
    const Pieces pieces{v.values, space, indices, corners};
    by = volume.check(method);
    try {
      verdicts = groups.is_none() ? by->check(pieces, options) : by->check_groups(pieces, labels, options);
    } catch (const GlUnavailable&) {
      volume.forget(method);
      throw;
    }
  }
  return {from_vector<std::uint8_t>(verdicts), by->method(), by->renderer()};
}

/// Returns the distance of point `i` in world units, or infinity if a double cannot hold it.
double distance_to(const ToleranceVolume& volume, const StoredSpace& space, const glm::dvec3& stored, std::size_t i) {
  const auto finite = [](const glm::dvec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  };
  const Frame& frame = volume.frame();
  const glm::dvec3 at = space.frame(stored);
  if (finite(at)) return volume.hierarchy().nearest(at).distance / frame.scale();
  const std::string name = "point " + std::to_string(i);
  if (!finite(stored)) throw InvalidInput(name + " is not finite", "invalid_mesh");
  const glm::dvec3 world = space.world(stored);
  if (!finite(world)) throw InvalidInput(name + " is too far away for double precision under to_world", "too_far");
  // The point is so far away that the reference counts as a point.
  const glm::dvec3 away = world - frame.centre();
  return std::hypot(away.x, away.y, away.z);
}

py::array_t<double> distance(const Volume& volume, const py::object& points, const py::object& to_world,
                             std::optional<int> threads, Progress* progress) {
  const Vertices v = to_vertices(points, "points");
  const StoredSpace space = StoredSpace(to_matrix(to_world), v.storage).in(volume.native.frame());
  std::vector<double> result(v.values.size());
  {
    const Interruptible call(progress);
    constexpr std::size_t kBlock = 256;
    parallel_for(result.size(), kBlock, to_threads(threads), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        result[i] = distance_to(volume.native, space, v.values[i], i);
      }
    });
  }
  return from_vector<double>(result);
}

py::tuple grid(const py::object& self, bool with_signs, Progress* progress) {
  const ToleranceVolume& volume = py::cast<const Volume&>(self).native;
  const DistanceGrid& g = volume.grid();
  py::object owner = self;
  const float* values = g.distance.data();
  if (with_signs && !g.is_signed) {
    auto made = std::make_unique<std::vector<float>>();
    {
      const Interruptible call(progress);
      *made = volume.signed_distance();
    }
    values = made->data();
    owner = py::capsule(made.release(), [](void* p) { delete static_cast<std::vector<float>*>(p); });
  }
  const py::ssize_t row = static_cast<py::ssize_t>(sizeof(float)) * g.pitch;
  py::array_t<float> view({py::ssize_t{g.nodes.z}, py::ssize_t{g.nodes.y}, py::ssize_t{g.nodes.x}},
                          {row * g.nodes.y, row, static_cast<py::ssize_t>(sizeof(float))}, values, owner);
  view.attr("setflags")(py::arg("write") = false);
  const glm::dvec3 origin = volume.frame().to_world(g.origin);
  return py::make_tuple(view, py::make_tuple(origin.x, origin.y, origin.z), g.spacing / volume.frame().scale(),
                        1 / volume.frame().scale());
}

}  // namespace

void bind_volume(py::module_& module) {
  py::class_<CheckResult>(module, "CheckResult", py::module_local(), "What ToleranceVolume.check found.")
      .def_readonly("verdicts", &CheckResult::verdicts,
                    "(m,) uint8: the Verdict of each face. Compare with Verdict.INSIDE: everything below counts as "
                    "outside.")
      .def_readonly("method", &CheckResult::method, "The name of the check, as reports give it.")
      .def_readonly("renderer", &CheckResult::renderer, "What computed it: \"CPU\" or the name of a GL renderer.");

  py::class_<Volume>(module, "ToleranceVolume", py::module_local(),
                     "All points within a tolerance of a reference mesh, with what makes questions about them fast.")
      .def(py::init(&make_volume), py::arg("vertices"), py::arg("triangles"), py::arg("tolerance"), py::kw_only(),
           py::arg("to_world") = py::none(), py::arg("precision") = py::none(), py::arg("grid_memory") = py::none(),
           py::arg("field") = "scatter", py::arg("threads") = py::none(), py::arg("progress") = py::none(),
           R"doc(Build the volume of a reference mesh.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
triangles : (m, 3) integer array
tolerance : float
    A positive length in world units, at most the diagonal of the reference.
precision : float, optional
    Grid nodes per tolerance, so many that the grid takes at most 256 MiB. None takes the finest of 1, 0.8, 0.64, ... whose
    grid fits grid_memory.
grid_memory : int, optional
    The most bytes that the grid takes if no precision is given. None is 256 MiB, and 16 GiB are the most. Less makes
    proofs slower, and no verdict wrong.
field : {"scatter", "gl", "fast_marching"}
    What fills the grid: exact distances, computed by the processor or, up to the rounding of float32, by a compute
    shader, or the method of the paper, which is signed, for comparison. With "gl" the number of triangles that a
    decimation leaves may depend on the graphics driver.
to_world, threads, progress
    See help(tolvol).

Raises
------
InvalidInput
    If the mesh or the tolerance is not valid. The message names the first offender.
ResourceLimit
    If the grid of this precision does not fit. The message names a precision that does.
GlUnavailable
    If field="gl" and there is no OpenGL 4.5.
Cancelled

Notes
-----
Precision and field change the speed of checks, and never make a proof wrong.

Cost: about 0.1 s for 70,000 triangles.

After M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 2.)doc")
      .def("check", &check, py::arg("points"), py::arg("faces"), py::kw_only(), py::arg("to_world") = py::none(),
           py::arg("groups") = py::none(), py::arg("method") = "certificate", py::arg("threads") = py::none(),
           py::arg("progress") = py::none(),
           R"doc(Decide for each face whether all of its points are within the tolerance.

Parameters
----------
points : (n, 3) float32 or float64 array
    Local coordinates.
faces : (m, k) integer array
    k is 1 (points), 2 (segments), 3 (triangles) or 4 (quads, in every triangulation).
groups : (m,) integer array, optional
    Every face gets the worst verdict of the faces with its label.
method : {"certificate", "gl_certificate", "occlusion_query", "paper", "paper_half_h"}
    "certificate" finds exact witnesses on the CPU, at any precision. It alone proves Verdict.OUTSIDE.
    "gl_certificate" does so in a compute shader, for batches of small faces. What it cannot prove is Verdict.UNPROVED.
    "occlusion_query" draws regular samples of each face and counts those that an interpolated distance shows to be
    outside. The volume needs a precision of 2 or more; 4 is good. With groups it makes one query for each: this is slow
    for small groups and fast for a single one.
    "paper" and "paper_half_h" are the check as it was published, with a margin of sqrt(3)/2 or 1/2 of the grid spacing.
    They are not conservative: a face that they call inside may be outside.
to_world, threads, progress
    See help(tolvol).

Returns
-------
CheckResult

Raises
------
InvalidInput
    If an argument is not valid, or if the method cannot use this volume.
GlUnavailable
    If a GL method finds no OpenGL 4.5, or if OpenGL fails on the way. No face is accepted then.
Cancelled

Notes
-----
Cost of "certificate": about 0.1 us for a small face.

After M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 4.)doc")
      .def("distance", &distance, py::arg("points"), py::kw_only(), py::arg("to_world") = py::none(),
           py::arg("threads") = py::none(), py::arg("progress") = py::none(),
           R"doc(Return the exact unsigned distance of points from the reference.

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
Cost: about 1 us a point.)doc")
      .def("grid", &grid, py::kw_only(), py::arg("signed") = false, py::arg("progress") = py::none(),
           R"doc(Return the distance grid of the volume.

Parameters
----------
signed : bool
    Whether distances inside are negative, by angle-weighted pseudonormals. The boundary of an open reference is
    extruded for this, and signed values jump across the extrusion. A volume with field="fast_marching" is signed anyway.
progress : Progress, optional

Returns
-------
distances : (nz, ny, nx) float32 array
    In units of `unit`, capped at the width of the band. It is read-only, and a view of the volume's memory unless
    `signed` makes a copy.
origin : tuple of three floats
    The place of the first node, in world units.
spacing : float
    The distance between two nodes, in world units.
unit : float
    A distance of 1 in world units.

Raises
------
Cancelled

Notes
-----
Cost: none for the view. Signs take about a quarter of the time that the field takes.)doc")
      .def_property_readonly(
          "tolerance", [](const Volume& v) { return v.native.tolerance(); }, "The tolerance, in world units.")
      .def_property_readonly(
          "diagonal", [](const Volume& v) { return v.native.diagonal(); },
          "The size of the reference as the function diagonal gives it, in world units.")
      .def_property_readonly(
          "precision", [](const Volume& v) { return v.native.precision(); }, "The number of grid nodes per tolerance.")
      .def_property_readonly(
          "field", [](const Volume& v) { return name_of(v.native.field()); }, "What filled the distance grid.")
      .def_property_readonly(
          "spacing", [](const Volume& v) { return v.native.grid().spacing / v.native.frame().scale(); },
          "The distance between two grid nodes, in world units.")
      .def_property_readonly(
          "memory", [](const Volume& v) { return v.native.memory(); }, "The number of bytes that the volume holds.")
      .def_readonly("vertex_count", &Volume::vertices, "The number of vertices of the reference.")
      .def_readonly("triangle_count", &Volume::triangles, "The number of triangles of the reference.")
      .def_readonly("seconds", &Volume::seconds, "The time that it took to build the volume.");

  module.def(
      "diagonal",
      [](const py::object& vertices, const py::object& triangles, const py::object& to_world) {
        const Vertices v = to_vertices(vertices, "vertices");
        const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
        validate(v.values, t);
        return longest_diagonal(v.values, t, StoredSpace(to_matrix(to_world), v.storage).to_world());
      },
      py::arg("vertices"), py::arg("triangles"), py::kw_only(), py::arg("to_world") = py::none(),
      R"doc(Return the size of a mesh, of which a tolerance in percent is taken.

This is the longest of the four diagonals of the local bounding box of the vertices that a triangle uses, after to_world.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
triangles : (m, 3) integer array
to_world
    See help(tolvol).

Returns
-------
float
    World units.

Raises
------
InvalidInput)doc");
}

}  // namespace tolvol::python
