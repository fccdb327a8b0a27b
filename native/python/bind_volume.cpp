// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <chrono>
#include <cmath>

#include "base/errors.h"
#include "base/parallel.h"
#include "check/tolerance_volume.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "python/volume.h"

namespace tolvol::python {
namespace {

Field to_field(const std::string& name) {
  if (name == "scatter") return Field::scatter;
  if (name == "fast_marching") return Field::fast_marching;
  throw InvalidInput("unknown field \"" + name + "\"; there are: scatter, fast_marching");
}

std::unique_ptr<Volume> make_volume(const py::object& vertices, const py::object& triangles, double tolerance,
                                    const py::object& to_world, std::optional<double> precision,
                                    const std::string& field, int threads, Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  const StoredSpace space(to_matrix(to_world), v.storage);
  const Interruptible call(progress);
  const auto start = std::chrono::steady_clock::now();
  auto volume = std::unique_ptr<Volume>(
      new Volume{{v.values, t, space, tolerance, {precision, to_threads(threads), progress, to_field(field)}},
                 v.values.size(),
                 t.size()});
  volume->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return volume;
}

struct CheckResult {
  py::array_t<std::uint8_t> verdict;
  std::string method, renderer;
};

CheckResult check(const Volume& volume, const py::object& points, const py::object& faces, const py::object& to_world,
                  const py::object& groups, const std::string& method, int threads, Progress* progress) {
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
    const PlacedPoints placed(v.values, space, volume.native);
    const Pieces pieces{placed.points, indices, corners, placed.mapping_error};
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

/// Of point `i`, in world units; infinity where that is more than a double holds.
double distance_to(const ToleranceVolume& volume, const StoredSpace& space, const glm::dvec3& stored, std::size_t i) {
  const auto finite = [](const glm::dvec3& p) {
    return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
  };
  const Frame& frame = volume.frame();
  const glm::dvec3 at = space.frame(stored);
  if (finite(at)) return volume.hierarchy().nearest(at).distance / frame.scale();
  const std::string name = "point " + std::to_string(i);
  if (!finite(stored)) throw InvalidInput(name + " is not finite");
  const glm::dvec3 world = space.world(stored);
  if (!finite(world)) throw InvalidInput(name + " is too far away for double precision under to_world");
  // So much farther than the reference is large that the reference is a point.
  const glm::dvec3 away = world - frame.to_world(glm::dvec3(0));
  return std::hypot(away.x, away.y, away.z);
}

py::array_t<double> distance(const Volume& volume, const py::object& points, const py::object& to_world, int threads,
                             Progress* progress) {
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
      .def_readonly("verdict", &CheckResult::verdict,
                    "(m,) uint8: 0 outside (proved), 1 unproved (counts as outside), 2 inside (proved).")
      .def_readonly("method", &CheckResult::method)
      .def_readonly("renderer", &CheckResult::renderer);

  py::class_<Volume>(module, "ToleranceVolume", py::module_local(),
                     "All points within a tolerance of a reference mesh, and fast ways to ask about them.")
      .def(py::init(&make_volume), py::arg("vertices"), py::arg("triangles"), py::arg("tolerance"),
           py::arg("to_world") = py::none(), py::arg("precision") = py::none(), py::arg("field") = "scatter",
           py::arg("threads") = 0, py::arg("progress") = py::none(),
           "vertices: (n, 3) float32 or float64, local. triangles: (m, 3) integers. tolerance: world units, at most "
           "the size of the\n"
           "reference. precision: grid nodes per tolerance; None takes the finest of 1, 1/2, 1/4, ... that fits 256 "
           "MB. field:\n"
           "what fills the grid: \"scatter\" (exact distances) or \"fast_marching\" (the paper's way, signed, for "
           "comparison). Both change\n"
           "speed and never a verdict's truth. Raises InvalidInput (bad mesh or tolerance; the first offender is "
           "named) and\n"
           "ResourceLimit (a precision that does not fit). Cost: about 0.1 s for 70,000 triangles.\n"
           "After M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 2.")
      .def("check", &check, py::arg("points"), py::arg("faces"), py::arg("to_world") = py::none(),
           py::arg("groups") = py::none(), py::arg("method") = "certificate", py::arg("threads") = 0,
           py::arg("progress") = py::none(),
           "Whether faces are within the tolerance, as a whole and not only at their corners. points: (k, 3) float32 "
           "or float64.\n"
           "faces: (m, c) integers, c from 1 (points) to 4 (quads, in every triangulation). groups: (m,) integers; "
           "every face gets\n"
           "the worst verdict of its group. Returns a CheckResult. method:\n"
           "\"certificate\": exact witnesses, on the CPU, at any precision; the only one that proves outside. About "
           "0.1 us "
           "a small face.\n"
           "\"gl_certificate\": the same in a compute shader, for batches of small faces; what it cannot prove is "
           "unproved.\n"
           "\"occlusion_query\": interpolated distances at a lattice on each face, drawn and counted; the grid must "
           "have "
           "a precision\n"
           "of 2 or more, 4 is good. With groups one query each: slow for small groups, fast for a single one.\n"
           "\"paper\", \"paper_half_h\": the check as it was published, with a margin of (sqrt(3)/2) h or h/2 for the "
           "grid "
           "spacing h;\n"
           "NOT conservative: what it calls inside may be outside.\n"
           "Raises GlUnavailable, with nothing accepted, where a GL method finds no OpenGL 4.5 or fails on the way.\n"
           "After M. Botsch et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 4.")
      .def("distance", &distance, py::arg("points"), py::arg("to_world") = py::none(), py::arg("threads") = 0,
           py::arg("progress") = py::none(),
           "(k,) float64: the exact unsigned distance of (k, 3) points to the reference, in world units. Raises "
           "InvalidInput,\n"
           "Cancelled. Cost: about 1 us a point.")
      .def("grid", &grid, py::kw_only(), py::arg("signed") = false, py::arg("progress") = py::none(),
           "The distance grid as (distances, origin, spacing, unit): distances is a read-only float32 array (nz, ny, "
           "nx) in units of\n"
           "`unit` world lengths, capped at the band; origin and spacing are in world units. A view, unsigned with "
           "field=\"scatter\". signed:\n"
           "negative inside, by angle-weighted pseudonormals, a copy made in about a quarter of the field's time; the "
           "field "
           "\"fast_marching\" is\n"
           "signed anyway. Of an open reference the boundary is extruded, and signed values jump across that.")
      .def_property_readonly(
          "tolerance", [](const Volume& v) { return v.native.tolerance(); }, "World units.")
      .def_property_readonly(
          "size", [](const Volume& v) { return v.native.diagonal(); },
          "What 100 % is, world units: the longest box diagonal of the reference.")
      .def_property_readonly(
          "precision", [](const Volume& v) { return v.native.precision(); }, "Grid nodes per tolerance.")
      .def_property_readonly(
          "field", [](const Volume& v) { return v.native.field() == Field::scatter ? "scatter" : "fast_marching"; },
          "What filled the distance grid.")
      .def_property_readonly(
          "spacing", [](const Volume& v) { return v.native.grid().spacing / v.native.frame().scale(); },
          "Between grid nodes, world units.")
      .def_property_readonly(
          "memory", [](const Volume& v) { return v.native.memory(); }, "Bytes held.")
      .def_readonly("vertex_count", &Volume::vertices)
      .def_readonly("triangle_count", &Volume::triangles)
      .def_readonly("seconds", &Volume::seconds, "Time it took to build.");

  module.def(
      "size",
      [](const py::object& vertices, const py::object& triangles, const py::object& to_world) {
        const Vertices v = to_vertices(vertices, "vertices");
        const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
        validate(v.values, t);
        return longest_diagonal(v.values, t, StoredSpace(to_matrix(to_world), v.storage).to_world());
      },
      py::arg("vertices"), py::arg("triangles"), py::arg("to_world") = py::none(),
      "What 100 % means, world units: the longest of the four diagonals of the local bounding box of the used "
      "vertices, after\n"
      "to_world.");
}

}  // namespace tolvol::python
