// SPDX-License-Identifier: GPL-3.0-or-later
/// Builds OpenMesh's connectivity of all triangles of a mesh at once, and collapses edges in it.
#pragma once

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <cstddef>
#include <glm/glm.hpp>
#include <span>

#include "base/parallel.h"

namespace tolvol {

/// Makes `mesh` the same, down to every index, as new_vertex() for each vertex and add_face() for each triangle would,
/// in a fraction of the time. `mesh` must be empty. The triangles must be an oriented manifold with boundary, each on
/// three vertices, with at most one edge between two vertices, which is not checked. `mates` are those of a CutMesh.
/// Throws std::logic_error if joined sides do not run against each other, or if the faces around a vertex are not one
/// fan. O(n + m).
void connect(std::size_t vertices, std::span<const glm::uvec3> triangles, std::span<const std::uint32_t> mates,
             OpenMesh::TriConnectivity& mesh, Team& team);

/// Does the same, down to every index, as mesh.collapse(h), without a walk around the vertex that stays. O(faces around
/// the vertex that vanishes, the start of `h`). `mesh` must have all status attributes, and mesh.is_collapse_ok(h) must
/// hold.
void collapse(OpenMesh::TriConnectivity& mesh, OpenMesh::HalfedgeHandle h);

}  // namespace tolvol
