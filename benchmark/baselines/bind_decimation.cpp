// SPDX-License-Identifier: GPL-3.0-or-later
/// The product's decimation with another method deciding about the collapses.
#include <pybind11/stl.h>

#include <chrono>
#include <memory>
#include <optional>

#include "base/errors.h"
#include "baselines/checked_ring.h"
#include "baselines/module.h"
#include "baselines/permission_ring.h"
#include "baselines/vertex_samples.h"
#include "check/methods.h"
#include "decimation/decimation.h"
#include "python/arrays.h"

namespace tolvol::baselines {
namespace {

namespace py = pybind11;
using Seconds = std::chrono::duration<double>;

/// Zelinka and Garland recommend so many cells per tolerance.
constexpr double kPermissionPrecision = 4;
/// A volume that nobody asks has so few nodes per tolerance.
constexpr std::optional<double> kCoarse = 1.0 / 16;

/// A baseline and what it needs, built within a time of its own.
struct Baseline {
  std::unique_ptr<PermissionGrid> grid;
  std::unique_ptr<ToleranceCheck> check;
  std::unique_ptr<RingCheck> ring;
  std::size_t memory = 0;  ///< bytes of the grid or texture it asks
};

/// Of a texture its texels, else distances and ids.
std::size_t asked_memory(const std::string& method, const DistanceGrid& grid) {
  const std::size_t nodes = static_cast<std::size_t>(grid.nodes.x) * grid.nodes.y * grid.nodes.z;
  if (method == "paper" || method == "paper_half_h") return nodes;
  return method == "occlusion_query" ? nodes * sizeof(float) : grid.memory();
}

Baseline make_baseline(const std::string& method, const ToleranceVolume& volume, std::optional<double> precision,
                       unsigned threads) {
  Baseline baseline;
  if (method == "permission_grid") {
    baseline.grid = std::make_unique<PermissionGrid>(volume.reference(), volume.frame_tolerance(),
                                                     precision.value_or(kPermissionPrecision), threads);
    baseline.ring = std::make_unique<PermissionRing>(*baseline.grid);
    baseline.memory = baseline.grid->memory();
  } else if (method == "vertex_samples") {
    baseline.ring = std::make_unique<VertexSamples>(volume.frame_tolerance());
  } else {
    baseline.check = make_check(method, volume);
    baseline.ring = std::make_unique<CheckedRing>(*baseline.check);
    baseline.memory = asked_memory(method, volume.grid());
  }
  return baseline;
}

py::tuple decimate_by(const py::object& vertices, const py::object& triangles, double tolerance,
                      const std::string& method, std::optional<double> precision, const std::string& placement,
                      std::optional<int> threads) {
  const python::Vertices v = python::to_vertices(vertices, "vertices");
  const std::vector<glm::uvec3> t = python::to_triangles(triangles, "triangles");
  if (placement != "optimal" && placement != "subset")
    throw InvalidInput("placement must be \"optimal\" or \"subset\"");
  DecimationOptions options;
  if (placement == "subset") options.placement = DecimationOptions::Placement::subset;
  options.threads = python::to_threads(threads);
  const StoredSpace space(glm::dmat4(1), v.storage);
  DecimationResult result;
  Seconds field, decimation;
  std::size_t memory = 0;
  {
    const py::gil_scoped_release release;
    // A baseline that does not ask the volume does not wait for it: only its frame is used.
    const bool asks_volume = method != "permission_grid" && method != "vertex_samples";
    auto start = std::chrono::steady_clock::now();
    const ToleranceVolume volume(v.values, t, space, tolerance,
                                 {asks_volume ? precision : kCoarse, options.threads, nullptr});
    if (!asks_volume) start = std::chrono::steady_clock::now();
    const Baseline baseline = make_baseline(method, volume, precision, options.threads);
    const auto built = std::chrono::steady_clock::now();
    options.baseline = baseline.ring.get();
    result = decimate(v.values, t, space, &volume, options);
    field = built - start, decimation = std::chrono::steady_clock::now() - built;
    memory = baseline.memory;
  }
  py::dict report;
  report["method"] = result.method, report["renderer"] = result.renderer;
  report["field_seconds"] = field.count(), report["seconds"] = decimation.count();
  report["memory"] = memory;
  return py::make_tuple(python::from_vertices(result.vertices, v.storage), python::from_triangles(result.triangles),
                        report);
}

}  // namespace

void bind_decimation(py::module_& module) {
  module.def("decimate", &decimate_by, py::arg("vertices"), py::arg("triangles"), py::arg("tolerance"),
             py::arg("method"), py::arg("precision") = py::none(), py::arg("placement") = "optimal",
             py::arg("threads") = py::none(),
             "(vertices, triangles, report) of tolvol.decimate with another method deciding about each collapse. "
             "Nothing is promised.\n"
             "method: \"permission_grid\", \"vertex_samples\", or one of ToleranceVolume.check. precision: grid nodes "
             "or cells per\n"
             "tolerance. report: method, renderer, field_seconds (to build what the method asks), seconds (of the "
             "decimation), memory\n"
             "(bytes of its grid or texture). Raises RuntimeError.");
}

}  // namespace tolvol::baselines
