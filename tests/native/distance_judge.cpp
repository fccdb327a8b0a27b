// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's Polygon_mesh_processing::bounded_error_Hausdorff_distance bisects triangles until its own bounds are closer
// than the error asked for.
#include "distance_judge.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/distance.h>
#include <CGAL/Surface_mesh.h>

#include <array>

namespace tolvol {
namespace {

using Surface = CGAL::Surface_mesh<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3>;

/// Every triangle with vertices of its own: a distance asks nothing of how they are connected, and so all meshes will
/// do.
Surface surface(const TriangleMesh& mesh) {
  Surface result;
  for (const glm::uvec3& t : mesh.triangles) {
    std::array<Surface::Vertex_index, 3> corners;
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& p = mesh.vertices[t[k]];
      corners[k] = result.add_vertex({p.x, p.y, p.z});
    }
    result.add_face(corners[0], corners[1], corners[2]);
  }
  return result;
}

}  // namespace

double distance_by_cgal(const TriangleMesh& a, const TriangleMesh& b, double error) {
  return CGAL::Polygon_mesh_processing::bounded_error_Hausdorff_distance<CGAL::Sequential_tag>(surface(a), surface(b),
                                                                                               error);
}

}  // namespace tolvol
