// SPDX-License-Identifier: GPL-3.0-or-later
/// OpenMesh's connectivity of all triangles of a mesh at once, and the collapse of an edge in it.
#pragma once

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <cstddef>
#include <glm/glm.hpp>
#include <span>

#include "base/parallel.h"

namespace tolvol {

/// The same, down to every index, that `mesh` would hold after new_vertex() for each vertex and add_face() for each
/// triangle, in a fraction of the time. `mesh` must be empty; the triangles an oriented manifold with boundary, each
/// on three vertices, with one edge between two vertices at most (not checked); `mates` as those of a CutMesh. Throws
/// std::logic_error where sides that are joined do not run against each other, or where the faces around a vertex are
/// not one fan. O(n + m).
void connect(std::size_t vertices, std::span<const glm::uvec3> triangles, std::span<const std::uint32_t> mates,
             OpenMesh::TriConnectivity& mesh, Team& team);

/// The same, down to every index, as mesh.collapse(h), without a walk around the vertex that stays: O(faces around the
/// vertex that vanishes, the start of `h`). `mesh` has the status of everything, and mesh.is_collapse_ok(h) holds.
void collapse(OpenMesh::TriConnectivity& mesh, OpenMesh::HalfedgeHandle h);

}  // namespace tolvol
