// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

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

struct Result {
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
  py::dict outside;
  outside["faces"] = r.outside_faces;
  outside["first"] = r.first_outside ? py::object(py::int_(*r.first_outside)) : py::object(py::none());
  outside["reference_faces"] = r.uncovered_faces;
  report["outside"] = outside;
  report["warnings"] = r.warnings;
  return report;
}

Result decimate_arrays(const py::object& vertices, const py::object& triangles, const Volume* volume,
                       const py::object& to_world, const std::string& placement, bool two_sided,
                       std::int64_t target_triangles, const py::object& locked, const py::object& shares,
                       const std::string& outside, const py::object& wedges, const std::string& effort,
                       double max_seconds, int threads, Progress* progress) {
  const Vertices v = to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = to_triangles(triangles, "triangles");
  const StoredSpace space(to_matrix(to_world), v.storage);
  DecimationOptions options;
  options.placement = choose(placement, "placement", "optimal", DecimationOptions::Placement::optimal, "subset",
                             DecimationOptions::Placement::subset);
  options.outside =
      choose(outside, "outside", "error", DecimationOptions::Outside::error, "keep", DecimationOptions::Outside::keep);
  options.effort = choose(effort, "effort", "fast", DecimationOptions::Effort::fast, "thorough",
                          DecimationOptions::Effort::thorough);
  if (!(max_seconds >= 0)) throw InvalidInput("max_seconds must not be negative");
  options.max_seconds = max_seconds;
  options.two_sided = two_sided;
  if (target_triangles < 0) throw InvalidInput("target_triangles must not be negative");
  options.target_triangles = static_cast<std::size_t>(target_triangles);
  py::array_t<bool, py::array::c_style> locked_values;
  if (!locked.is_none()) {
    locked_values = to_values<bool>(locked, "locked must be a bool array, one value for each vertex");
    options.locked = {locked_values.data(), static_cast<std::size_t>(locked_values.size())};
  }
  py::array_t<double, py::array::c_style> share_values;
  if (!shares.is_none()) {
    share_values = to_values<double>(shares, "shares must be a float64 array, one value for each vertex");
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
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  Result result;
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
  py::class_<Result>(module, "DecimationResult", py::module_local(),
                     "A decimated mesh, and where each part of it came from.")
      .def_readonly("vertices", &Result::vertices, "(k, 3), the input's dtype, local coordinates.")
      .def_readonly("triangles", &Result::triangles, "(l, 3) int32.")
      .def_readonly("vertex_map", &Result::vertex_map,
                    "(n,) int32: the result vertex that each input vertex was merged into; -1: no triangle uses it.")
      .def_readonly("vertex_source", &Result::vertex_source,
                    "(k,) int32: the input vertex that each result vertex continues.")
      .def_readonly("triangle_source", &Result::triangle_source,
                    "(l,) int32: the input triangle that each result triangle continues: unless edges around it were "
                    "flipped, its\n"
                    "corners are vertex_map of that triangle's corners, in order.")
      .def_readonly("source_triangle", &Result::source_triangle,
                    "(l, 3) int32: for each result corner the input triangle that its attributes are read from.")
      .def_readonly("source_weights", &Result::source_weights, "(l, 3, 3) float64: the barycentric weights there.")
      .def_readonly("report", &Result::report,
                    "dict: triangles_in, triangles_out, seconds, stopped_by (\"tolerance\", \"target\", \"time\" or "
                    "\"request\"), method,\n"
                    "renderer, repairs (kind, count, message), locked (vertices by cause), outside (faces, first, "
                    "reference_faces), warnings.");

  module.def(
      "decimate", &decimate_arrays, py::arg("vertices"), py::arg("triangles"), py::arg("volume").none(true),
      py::arg("to_world") = py::none(), py::arg("placement") = "optimal", py::arg("two_sided") = true,
      py::arg("target_triangles") = 0, py::arg("locked") = py::none(), py::arg("shares") = py::none(),
      py::arg("outside") = "error", py::arg("wedges") = py::none(), py::arg("effort") = "fast",
      py::arg("max_seconds") = 0.0, py::arg("threads") = 0, py::arg("progress") = py::none(),
      "Fewest triangles within the volume's tolerance: every point of the result within it of the reference and,\n"
      "two_sided, every point of the reference within it of the result.\n\n"
      "placement: \"optimal\" (fewest triangles) or \"subset\" (every surviving vertex is an original one, bit for\n"
      "bit). target_triangles: stop there if the tolerance lets it get so far; 0: as few as possible. locked: (n,) "
      "bool,\n"
      "vertices that neither move nor vanish; an edge between two of them stays. shares: (n,) float64, 0 to 1, how "
      "much\n"
      "of the tolerance the new faces around a vertex may use: so near to the reference does the result stay there.\n"
      "outside: \"error\", or \"keep\" the input faces that are not within the tolerance as they are. wedges: (m, 3)\n"
      "labels from wedges(). effort: \"fast\", or \"thorough\": then vertices move and edges flip to make room for\n"
      "further collapses, which leaves a seventh to a fifth fewer triangles in two to five times the processor time, "
      "at\n"
      "0.1 % five to seven times. max_seconds (0: none) ends either effort with what is proved by then, which depends "
      "on\n"
      "the machine's speed. It does not cut short the preparation, in which the mesh is set up and the input "
      "certified:\n"
      "about 0.7 us a triangle, and 2 us where the input is not the reference itself. volume None: no tolerance at "
      "all,\n"
      "for comparison; a target is needed.\n"
      "Raises InvalidInput and Cancelled. Cost of \"fast\": 4 to 6 us a triangle at 1 % on one thread, without the "
      "grid.\n"
      "Quadric error metric: M. Garland, P. Heckbert, 1997.");
  module.def("wedges", &wedges, py::arg("triangles"), py::arg("corners"),
             "(m, 3) int32 labels: two corners have the same label exactly when they are at the same vertex and all "
             "their values\n"
             "are equal. corners: (m, 3, k) float32, for example UVs.");
}

}  // namespace tolvol::python
