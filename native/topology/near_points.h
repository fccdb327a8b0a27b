// SPDX-License-Identifier: GPL-3.0-or-later
/// Finds the triangles near many points at once. Where thousands of needles end near each other, their boxes all meet
/// there, and a search for each point looks at most of them, although few go past any one point. Here points and
/// triangles are divided together: a triangle stays with those points whose box it meets itself.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// Calls visit(number of a point, triangles) once for every point, with all triangles of the mesh that are within
/// `reach` of it, and some others. Coordinates may be up to 2. Costs about 50 ns for each triangle that meets the box
/// of the points, and for each that meets the box of a half of them, and so on.
void for_each_near(std::span<const glm::dvec3> points, const TriangleMesh& mesh, double reach,
                   const std::function<void(std::uint32_t point, std::span<const std::uint32_t> triangles)>& visit);

}  // namespace tolvol
