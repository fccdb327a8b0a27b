// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether two triangles cross: an exact answer for the coordinates as they are stored.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "geometry/triangle_mesh.h"

namespace tolvol {

using Corners = std::array<glm::dvec3, 3>;

/// Triangles and positions that someone else holds.
struct MeshView {
  std::span<const glm::uvec3> triangles;
  std::span<const glm::dvec3> vertices;

  Corners corners(std::uint32_t triangle) const {
    const glm::uvec3& t = triangles[triangle];
    return {vertices[t.x], vertices[t.y], vertices[t.z]};
  }
};

Box box_of(const Corners& corners);

/// Whether the corners lie on one line or in one point, decided exactly. O(1).
bool is_degenerate(const Corners& t);

/// Two triangles cross when they meet anywhere but in the corners and edges that they share. A corner is shared where
/// both have the same coordinates. Triangles in one plane that overlap cross, and so do two triangles on the same three
/// corners. A degenerate triangle counts as the segment or the point that it is: it crosses what that meets, but two
/// degenerate triangles never cross. Coordinates must be finite. No rounding is involved: the predicates are CGAL's
/// (Exact_predicates_inexact_constructions_kernel). O(1), 20 ns to 1 us; more where predicates need exact arithmetic.
bool faces_cross(const Corners& a, const Corners& b);

}  // namespace tolvol
