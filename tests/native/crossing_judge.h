// SPDX-License-Identifier: GPL-3.0-or-later
/// The pairs of faces that cross, by CGAL: the independent judge.
#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace tolvol {

using CrossingPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Of an oriented manifold mesh, in order.
inline CrossingPairs crossings_by_cgal(const TriangleMesh& mesh) {
  using Surface = CGAL::Surface_mesh<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3>;
  Surface surface;
  for (const glm::dvec3& p : mesh.vertices) surface.add_vertex({p.x, p.y, p.z});
  for (const glm::uvec3& t : mesh.triangles) {
    using Vertex = Surface::Vertex_index;
    EXPECT_NE(surface.add_face(Vertex(t.x), Vertex(t.y), Vertex(t.z)), Surface::null_face()) << "a manifold";
  }
  std::vector<std::pair<Surface::Face_index, Surface::Face_index>> pairs;
  CGAL::Polygon_mesh_processing::self_intersections(surface, std::back_inserter(pairs));
  CrossingPairs sorted;
  for (const auto& [a, b] : pairs) sorted.emplace_back(std::min<std::uint32_t>(a, b), std::max<std::uint32_t>(a, b));
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

}  // namespace tolvol
