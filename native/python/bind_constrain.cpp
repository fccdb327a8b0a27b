// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include "operation/constrain.h"
#include "python/arrays.h"
#include "python/module.h"
#include "python/volume.h"
#include "reference/errors.h"

namespace tolvol::python {
namespace {

struct Constrained {
  py::array vertices;
  py::array_t<double> factors;
  py::dict report;
};

PullBack::Mode to_mode(const std::string& mode) {
  if (mode == "pull_back") return PullBack::Mode::pull_back;
  if (mode == "reset") return PullBack::Mode::reset;
  throw InvalidInput("mode must be \"pull_back\" or \"reset\", not \"" + mode + "\"");
}

Constrained constrain_arrays(const py::object& before, const py::object& after, const py::object& faces,
                             const Volume& volume, const py::object& to_world, const std::string& mode,
                             const std::string& outside, int threads, Progress* progress) {
  const Vertices from = to_vertices(before, "before"), to = to_vertices(after, "after");
  if (from.storage != to.storage) throw InvalidInput("before and after must have the same type");
  int corners = 3;
  const std::vector<std::uint32_t> indices = to_faces(faces, "faces", corners);
  const Placement placement(to_matrix(to_world), from.storage);
  ConstrainOptions options;
  options.mode = to_mode(mode);
  if (outside != "error" && outside != "keep") {
    throw InvalidInput("outside must be \"error\" or \"keep\", not \"" + outside + "\"");
  }
  options.outside = outside == "keep" ? ConstrainOptions::Outside::keep : ConstrainOptions::Outside::error;
  options.threads = to_threads(threads);
  options.progress = progress;
  ConstrainResult r;
  {
    const py::gil_scoped_release release;
    r = constrain(from.values, to.values, indices, corners, placement, volume.native, options);
  }
  Constrained result{from_vertices(r.vertices, from.storage), from_vector<double>(r.factors), {}};
  py::dict kept;
  kept["faces"] = r.outside_faces;
  kept["first"] = r.first_outside ? py::object(py::int_(*r.first_outside)) : py::object(py::none());
  result.report["held_back"] = r.held_back;
  result.report["outside"] = kept;
  result.report["method"] = r.method;
  result.report["renderer"] = r.renderer;
  result.report["warnings"] = r.warnings;
  return result;
}

}  // namespace

void bind_constrain(py::module_& module) {
  py::class_<Constrained>(module, "Constrained", py::module_local(), "What constrain found.")
      .def_readonly("vertices", &Constrained::vertices, "(n, 3), the type of the input, local.")
      .def_readonly("factors", &Constrained::factors,
                    "(n,) float64: the share of its motion that each vertex went, 0 to 1.")
      .def_readonly("report", &Constrained::report, "held_back (vertices), outside, method, renderer, warnings.");
  module.def("constrain", &constrain_arrays, py::arg("before"), py::arg("after"), py::arg("faces"), py::arg("volume"),
             py::arg("to_world") = py::none(), py::arg("mode") = "pull_back", py::arg("outside") = "error",
             py::arg("threads") = 0, py::arg("progress") = py::none(),
             "As much of a motion as the tolerance allows: vertex v ends at before + f (after - before), rounded as it "
             "is stored,\n"
             "f its factor; all faces are then inside. before, after: (n, 3), both float32 or both float64, local; "
             "before must be\n"
             "inside. faces: (m, k) integers, k from 1 (points) to 4 (quads, in every triangulation); a triangle among "
             "quads repeats a\n"
             "corner. A vertex that touches no face that failed has its wish, bit for bit.\n\n"
             "mode: \"pull_back\", where no single factor can rise by 1/64 alone, or \"reset\", all or nothing. "
             "outside: \"error\", or\n"
             "\"keep\" the vertices of faces that are outside in before where they are. Raises InvalidInput and "
             "Cancelled.\n"
             "Cost: about 1 us a vertex to certify before, 10 us for each that is held back. Reset: M. Botsch et al., "
             "GPU-based\n"
             "Tolerance Volumes for Mesh Processing, 2004, section 5.");
}

}  // namespace tolvol::python
