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

/// The place of `value` among the two that there are.
bool is_second(const std::string& value, const char* name, const char* first, const char* second) {
  if (value != first && value != second) {
    throw InvalidInput(std::string(name) + " must be \"" + first + "\" or \"" + second + "\", not \"" + value + "\"");
  }
  return value == second;
}

Smoothed smooth_arrays(const py::object& vertices, const py::object& triangles, const Volume* volume,
                       const py::object& to_world, std::int64_t iterations, const std::string& kind,
                       const std::string& weights, const std::string& boundary, const py::object& locked,
                       const py::object& strength, const std::string& mode, const std::string& outside, int threads,
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
  options.outside = is_second(outside, "outside", "error", "keep") ? ConstrainOptions::Outside::keep
                                                                   : ConstrainOptions::Outside::error;
  py::array_t<bool, py::array::c_style> locked_values;
  if (!locked.is_none()) {
    locked_values = to_values<bool>(locked, "locked must be a bool array, one value for each vertex");
    options.locked = {locked_values.data(), static_cast<std::size_t>(locked_values.size())};
  }
  py::array_t<double, py::array::c_style> strength_values;
  if (!strength.is_none()) {
    strength_values = to_values<double>(strength, "strength must be a float64 array, one value for each vertex");
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
  py::dict fixed, kept;
  fixed["boundary"] = r.fixed_boundary;
  fixed["non-manifold"] = r.fixed_non_manifold;
  kept["faces"] = r.outside_faces;
  kept["first"] = r.first_outside ? py::object(py::int_(*r.first_outside)) : py::object(py::none());
  result.report["held_back"] = r.held_back;
  result.report["largest_motion"] = r.largest_motion;
  result.report["welded"] = r.welded;
  result.report["fixed"] = fixed;
  result.report["outside"] = kept;
  result.report["method"] = r.method;
  result.report["renderer"] = r.renderer;
  result.report["warnings"] = r.warnings;
  result.report["seconds"] = seconds;
  return result;
}

}  // namespace

void bind_smoothing(py::module_& module) {
  py::class_<Smoothed>(module, "Smoothed", py::module_local(), "What smooth found.")
      .def_readonly("vertices", &Smoothed::vertices, "(n, 3), the type of the input, local.")
      .def_readonly("report", &Smoothed::report,
                    "held_back (vertices, for each iteration), largest_motion (world units), welded (vertices treated "
                    "as one with an\n"
                    "earlier one at the same place), fixed {boundary, non-manifold}, outside {faces, first}, method, "
                    "renderer, warnings,\n"
                    "seconds.");
  module.def(
      "smooth", &smooth_arrays, py::arg("vertices"), py::arg("triangles"), py::arg("volume") = py::none(),
      py::arg("to_world") = py::none(), py::arg("iterations") = 10, py::arg("operator") = "bilaplacian",
      py::arg("weights") = "cotangent", py::arg("boundary") = "fixed", py::arg("locked") = py::none(),
      py::arg("strength") = py::none(), py::arg("mode") = "pull_back", py::arg("outside") = "error",
      py::arg("threads") = 0, py::arg("progress") = py::none(),
      "Smooths a mesh within the volume's tolerance, or without bound when there is none; every face ends inside."
      "\n\n"
      "operator: \"laplacian\" or \"bilaplacian\" (keeps curvature better). weights: \"uniform\" (also evens out "
      "the triangles) or\n"
      "\"cotangent\" (keeps them), measured in the world. boundary: \"fixed\", or \"along\" to smooth it along "
      "itself. locked:\n"
      "(n,) bool, vertices that stay. strength: (n,) float64, 0 to 1, of a full step. mode: \"pull_back\" along "
      "the step until\n"
      "the faces around are inside, or \"reset\", where a vertex stays for this iteration instead. outside: "
      "\"error\", or \"keep\"\n"
      "the input faces that are not within the tolerance as they are. Vertices of edges with more than two "
      "faces stay.\n"
      "Raises InvalidInput and Cancelled. Cost: about 0.3 us an iteration and vertex, and some us for each that "
      "is held back.\n"
      "After M. Desbrun et al., Implicit Fairing of Irregular Meshes using Diffusion and Curvature Flow, 1999; "
      "reset: M. Botsch\n"
      "et al., GPU-based Tolerance Volumes for Mesh Processing, 2004, section 5.");
}

}  // namespace tolvol::python
