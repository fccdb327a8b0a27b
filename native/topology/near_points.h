// SPDX-License-Identifier: GPL-3.0-or-later
/// Finds the triangles near many points at once. Where thousands of needles end near each other, their boxes all meet
/// there, and a search for each point looks at most of them, although few go past any one point. Here points and
/// triangles are divided together: a triangle stays with those points whose box it meets itself.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// Calls visit(number of a point, triangles) once for every point, with all triangles of the mesh that are within its
/// `reach` of it, and some others. Coordinates may be up to 2. Costs about 50 ns for each triangle of the mesh, as much
/// again for each that meets the box of the points, again for each that meets the box of a half of them, and so on.
/// Runs on one thread.
void for_each_near(std::span<const glm::dvec3> points, std::span<const double> reach, const TriangleMesh& mesh,
                   const std::function<void(std::uint32_t point, std::span<const std::uint32_t> triangles)>& visit);

}  // namespace tolvol
