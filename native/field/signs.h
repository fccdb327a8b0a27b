// SPDX-License-Identifier: GPL-3.0-or-later
/// Signs for the distances of a grid, negative inside the reference as Pseudonormals tell it. Pictures and the checks
/// that interpolate need them; the certificate does not.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "field/distance_grid.h"
#include "geometry/pseudonormals.h"

namespace tolvol {

/// Returns one value for each node, in the grid's order and pitch. If the reference is closed every sign is right. If
/// not, Pseudonormals continue the surface beyond its boundary, and the values jump across that continuation. Nodes
/// beyond the band get the sign of the nodes beside them. The values of a signed grid are returned as they are. O(m log
/// valence + nodes), about a quarter of the time of scatter().
std::vector<float> signed_distance(const TriangleMesh& reference, const DistanceGrid& grid, unsigned threads = 0);
/// The same for a caller that has the pseudonormals of the reference.
std::vector<float> signed_distance(const TriangleMesh& reference, const Pseudonormals& normals,
                                   const DistanceGrid& grid, unsigned threads = 0);

/// Gives the nodes that have a triangle their sign. `distance` is grid.distance, unsigned before the call.
void sign_by_triangle(const TriangleMesh& reference, const Pseudonormals& normals, const DistanceGrid& grid,
                      std::span<float> distance, unsigned threads);

/// Gives every node for which `known` is zero the sign of a known node, in two sweeps over the grid. The sign is right
/// if the surface is never between two adjacent nodes of which one is unknown.
void spread_signs(const DistanceGrid& grid, std::vector<std::uint8_t> known, std::span<float> distance);

}  // namespace tolvol
