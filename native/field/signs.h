// SPDX-License-Identifier: GPL-3.0-or-later
/// Signs for the distances of a grid: negative inside the reference, as Pseudonormals tell it. For pictures and for the
/// ways of checking that interpolate; the certificate needs none.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "field/distance_grid.h"
#include "geometry/pseudonormals.h"

namespace tolvol {

/// One value a node, in the grid's order and pitch. Where the reference is closed every sign is right; elsewhere the
/// surface is continued beyond its boundary (see Pseudonormals), and the values jump across that continuation. Nodes
/// beyond the band get the sign of those beside them. A grid that is signed already is returned as it is. O(m log
/// valence + nodes), about a quarter of the time of scatter().
std::vector<float> signed_distance(const TriangleMesh& reference, const DistanceGrid& grid, unsigned threads = 0);
/// The same, with the reference's own pseudonormals at hand.
std::vector<float> signed_distance(const TriangleMesh& reference, const Pseudonormals& normals,
                                   const DistanceGrid& grid, unsigned threads = 0);

/// Gives the nodes that have a triangle their sign; `distance` as grid.distance, not signed so far.
void sign_by_triangle(const TriangleMesh& reference, const Pseudonormals& normals, const DistanceGrid& grid,
                      std::span<float> distance, unsigned threads);

/// Gives every node for which `known` is zero the sign of a known one, in two sweeps over the grid: the right one as
/// long as no two nodes beside each other, one of them unknown, have the surface between them.
void spread_signs(const DistanceGrid& grid, std::vector<std::uint8_t> known, std::span<float> distance);

}  // namespace tolvol
