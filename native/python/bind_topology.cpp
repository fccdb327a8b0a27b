// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <limits>

#include "geometry/frame.h"
#include "geometry/weld.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"
#include "topology/area_and_volume.h"
#include "topology/crossings.h"
#include "topology/solidity.h"

namespace tolvol::python {
namespace {

py::dict solidity_facts(const py::object& vertices, const py::object& triangles, const py::object& to_world,
                        std::optional<int> threads, Progress* progress) {
  const TriangleMesh mesh = to_mesh(vertices, triangles);
  const StoredSpace space(to_matrix(to_world), Storage::float64);
  mesh.triangles.empty() ? require_finite(mesh.vertices) : validate(mesh.vertices, mesh.triangles);
  Solidity found;
  AreaAndVolume extent;
  {
    const Interruptible call(progress);
    Team team(thread_count(to_threads(threads)));
    found = solidity(mesh.vertices, mesh.triangles, team);
    extent = area_and_volume(mesh.vertices, mesh.triangles, found.shell_of, glm::dmat3(space.to_world()));
  }
  const bool is_solid = found.closed() && found.oriented() && found.non_manifold_edges == 0;
  py::dict facts;
  facts["closed"] = found.closed();
  facts["boundary_loops"] = found.boundary_loops;
  facts["open_edges"] = found.open_edges;
  facts["manifold"] = found.manifold();
  facts["non_manifold_edges"] = found.non_manifold_edges;
  facts["non_manifold_vertices"] = found.non_manifold_vertices;
  facts["oriented"] = found.oriented();
  facts["misoriented_edges"] = found.misoriented_edges;
  facts["degenerate_triangles"] = found.degenerate_triangles;
  facts["shells"] = found.shells;
  facts["area"] = extent.area;
  facts["volume"] = is_solid ? py::object(py::float_(extent.volume)) : py::object(py::none());
  return facts;
}

/// Returns the vertices that stay, and for each vertex its row among them.
template <class Real>
py::tuple weld_array(const py::array_t<Real, py::array::c_style>& vertices, unsigned threads) {
  const std::span<const glm::vec<3, Real>> positions(reinterpret_cast<const glm::vec<3, Real>*>(vertices.data()),
                                                     static_cast<std::size_t>(vertices.shape(0)));
  py::array_t<std::int32_t> row(vertices.shape(0));
  const std::span<std::int32_t> rows(row.mutable_data(), positions.size());
  std::vector<glm::vec<3, Real>> kept;
  {
    const Interruptible call;
    Team team(thread_count(threads));
    const std::vector<std::uint32_t> first = weld_equal_positions(positions, team);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      poll_at(i);
      rows[i] = first[i] == i ? static_cast<std::int32_t>(kept.size()) : rows[first[i]];
      if (first[i] == i) kept.push_back(positions[i]);
    }
  }
  py::array_t<Real> stay(std::vector<py::ssize_t>{static_cast<py::ssize_t>(kept.size()), 3});
  std::copy(kept.begin(), kept.end(), reinterpret_cast<glm::vec<3, Real>*>(stay.mutable_data()));
  return py::make_tuple(stay, row);
}

py::tuple weld(const py::object& vertices, std::optional<int> threads) {
  const Storage storage = require_vertices(vertices, "vertices");
  const unsigned count = to_threads(threads);
  return storage == Storage::float32 ? weld_array<float>(vertices, count) : weld_array<double>(vertices, count);
}

}  // namespace

void bind_topology(py::module_& module) {
  module.def("weld", &weld, py::arg("vertices"), py::kw_only(), py::arg("threads") = py::none(),
             R"doc(Make vertices at exactly the same position one vertex.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    -0 is 0. A coordinate that is not a number differs from all others.
threads
    See help(tolvol).

Returns
-------
vertices : (k, 3) array
    The first vertex at each position, in their order.
row : (n,) int32 array
    For each vertex of the argument, the row of its position among these.

Raises
------
InvalidInput
    If `vertices` is no (n, 3) array of float32 or float64.

The call takes 0.03 to 0.05 us for each vertex on one thread.)doc");
  module.def(
      "crossing_pairs",
      [](const py::object& vertices, const py::object& triangles, std::optional<std::int64_t> most,
         std::optional<int> threads, Progress* progress) {
        if (most && *most < 1) throw InvalidInput("most must be at least 1, or None for no limit");
        const TriangleMesh mesh = to_mesh(vertices, triangles);
        validate(mesh.vertices, mesh.triangles);
        std::vector<glm::uvec2> pairs;
        {
          const Interruptible call(progress);
          Team team(thread_count(to_threads(threads)));
          const auto limit = most ? static_cast<std::size_t>(*most) : std::numeric_limits<std::size_t>::max();
          pairs = crossings(mesh.vertices, mesh.triangles, limit, team, progress).pairs;
        }
        py::array_t<std::int32_t> rows({py::ssize_t(pairs.size()), py::ssize_t(2)});
        for (std::size_t i = 0; i < pairs.size(); ++i) {
          for (int k = 0; k < 2; ++k) rows.mutable_at(i, k) = static_cast<std::int32_t>(pairs[i][k]);
        }
        return rows;
      },
      py::arg("vertices"), py::arg("triangles"), py::kw_only(), py::arg("most") = py::none(),
      py::arg("threads") = py::none(), py::arg("progress") = py::none(),
      R"doc(Return the pairs of triangles that cross each other, exactly.

Two triangles cross if they meet anywhere but in the corners and edges that they share. A corner is shared if both have
the same coordinates. Triangles in one plane that overlap cross, and so do two triangles on the same three corners. A
triangle without an area crosses what its segment or point meets; two such triangles never cross.

Parameters
----------
vertices : (n, 3) float32 or float64 array
triangles : (m, 3) integer array
most : int, optional
    Return at most this many pairs. Where there are more, it is not promised which ones. Among 100,000 triangles on one
    place there are five thousand million.
threads, progress
    See help(tolvol).

Returns
-------
(k, 2) int32 array
    Indices of triangles, the lower one first, in order. A mesh without crossings has none.

Raises
------
InvalidInput
    If the mesh is not valid.
Cancelled

The predicates are CGAL's, and no epsilon is involved. The call takes about 1.3 us for each triangle on one thread, and
more where boxes of many triangles overlap.)doc");
  module.def("solidity", &solidity_facts, py::arg("vertices"), py::arg("triangles"), py::kw_only(),
             py::arg("to_world") = py::none(), py::arg("threads") = py::none(), py::arg("progress") = py::none(),
             R"doc(Tell whether a mesh bounds a solid: facts about how its triangles are connected.

Vertices at the same position are one vertex. All facts but the area and the volume are exact.

Parameters
----------
vertices : (n, 3) float32 or float64 array
    Local coordinates.
triangles : (m, 3) integer array
to_world : (4, 4) array, optional
    The matrix from local to world space, the identity by default. Only the area and the volume depend on it.
threads, progress
    See help(tolvol).

Returns
-------
dict
    closed, boundary_loops, open_edges : whether there is no open edge, which belongs to one triangle; the number of
        groups of open edges that touch; the number of open edges
    manifold, non_manifold_edges, non_manifold_vertices : whether there are no edges of more than two triangles, and no
        vertices at which the triangles do not all hang together by edges; their numbers
    oriented, misoriented_edges : whether there are no edges through which both triangles run in the same direction;
        their number
    degenerate_triangles : the number of triangles with two equal corners, which are left out of all other counts
    shells : the number of groups of triangles that hang together by edges
    area, volume : in the units of the world, 0 or infinite beyond the range of double. The volume is negative if the
        faces look inwards in the local space, also where the matrix mirrors them, and None unless the mesh is closed
        and oriented and no edge has more than two triangles.

Raises
------
InvalidInput
    If the mesh or the matrix is not valid.
Cancelled

crossing_pairs() tells whether the triangles cross each other. The call takes about 0.3 us for each triangle.)doc");
}

}  // namespace tolvol::python
