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

PullBack::Mode to_mode(const std::string& mode) {
  if (mode == "pull_back") return PullBack::Mode::pull_back;
  if (mode == "reset") return PullBack::Mode::reset;
  throw InvalidInput("mode must be \"pull_back\" or \"reset\", not \"" + mode + "\"");
}

ConstrainOptions::Outside to_outside(const std::string& outside) {
  if (outside == "error") return ConstrainOptions::Outside::error;
  if (outside == "keep") return ConstrainOptions::Outside::keep;
  throw InvalidInput("outside must be \"error\" or \"keep\", not \"" + outside + "\"");
}

Constrained constrain_arrays(const py::object& before, const py::object& after, const py::object& faces,
                             const Volume& volume, const py::object& to_world, const std::string& mode,
                             const std::string& outside, int threads, Progress* progress) {
  const Vertices from = to_vertices(before, "before"), to = to_vertices(after, "after");
  if (from.storage != to.storage) throw InvalidInput("before and after must have the same type");
  int corners = 3;
  const std::vector<std::uint32_t> indices = to_faces(faces, "faces", corners);
  const StoredSpace space(to_matrix(to_world), from.storage);
  ConstrainOptions options;
  options.mode = to_mode(mode);
  options.outside = to_outside(outside);
  options.threads = to_threads(threads);
  options.progress = progress;
  ConstrainResult r;
  {
    const Interruptible call(progress);
    r = constrain(from.values, to.values, indices, corners, space, volume.native, options);
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

/// (n, 3) float32; copied only where it does not lie in memory as a whole.
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
                                        const py::object& to_world, const std::string& outside, int threads,
                                        Progress* progress) {
  const Positions p = to_positions(positions);
  int corners = 3;
  std::vector<std::uint32_t> indices = to_faces(faces, "faces", corners);
  const glm::dmat4 matrix = to_matrix(to_world);
  const Guard::Options options{to_outside(outside), to_threads(threads), progress};
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

}  // namespace

void bind_constrain(py::module_& module) {
  py::class_<Constrained>(module, "Constrained", py::module_local(), "What constrain found.")
      .def_readonly("vertices", &Constrained::vertices, "(n, 3), the type of the input, local.")
      .def_readonly("factors", &Constrained::factors,
                    "(n,) float64: the share of its motion that each vertex went, 0 to 1.")
      .def_readonly("report", &Constrained::report, "held_back (vertices), outside, method, renderer, warnings.");
  module.def(
      "constrain", &constrain_arrays, py::arg("before"), py::arg("after"), py::arg("faces"), py::arg("volume"),
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
      "Cost: about 1 us a vertex to certify before; for each that is held back 2 to 20 us where neighbours move alike "
      "over a smooth\n"
      "reference, and 100 to 400 us where the reference is rough or each is pushed its own way by several tolerances. "
      "Among large\n"
      "triangles that run through each other searches look at a share of them all: with 3,000 random ones 1.2 ms for "
      "each that is\n"
      "held back. Reset: M. Botsch "
      "et al., "
      "GPU-based\n"
      "Tolerance Volumes for Mesh Processing, 2004, section 5.");

  py::class_<LockedGuard>(
      module, "Guard", py::module_local(),
      "Keeps a mesh that is edited by other hands inside a volume, edit by edit, as constrain does. "
      "An edit costs what it\n"
      "touches and a comparison of all positions with the last ones: about 1 ms for 1,000 of a "
      "million vertices, and\n"
      "for each that is held back as constrain.")
      .def(py::init(&make_guard), py::arg("positions"), py::arg("faces"), py::arg("volume"),
           py::arg("to_world") = py::none(), py::arg("outside") = "error", py::arg("threads") = 0,
           py::arg("progress") = py::none(), py::keep_alive<1, 4>(),
           "positions: (n, 3) float32, local, the state to start from. faces, outside: as for constrain. Raises "
           "InvalidInput and\n"
           "Cancelled. Cost: about 1 us a vertex.")
      .def("constrain", &guard_constrain, py::arg("positions"), py::arg("progress") = py::none(),
           "Takes the mesh as it was edited since the last call and returns (indices (k,) int32, positions (k, 3) "
           "float32): the\n"
           "vertices that have to go back, and where to; write them before the next call. All others stay bit for bit "
           "as they came.\n"
           "positions: (n, 3) float32, not copied when contiguous. Undo is an edit like others. Raises InvalidInput "
           "for another\n"
           "number of vertices and for one that moved and is not finite, and Cancelled; both keep the state.")
      .def("reset", &guard_reset, py::arg("positions"), py::arg("progress") = py::none(),
           "Starts anew from these positions. Raises InvalidInput, keeping the state, when faces are outside; "
           "Cancelled. Cost: about\n"
           "1 us a vertex.")
      .def_property_readonly("vertex_count", [](const LockedGuard& guard) { return guard.native.vertex_count(); })
      .def_property_readonly(
          "outside", [](const LockedGuard& guard) { return from_vector<std::int32_t>(guard.native.outside()); },
          "(k,) int32: the faces that were outside at the start; their vertices never move.")
      .def_property_readonly(
          "warning", [](const LockedGuard& guard) { return guard.native.warning(); },
          "What the stored type costs at these coordinates, when it is 1 % of the tolerance or more; else None.");
}

}  // namespace tolvol::python
