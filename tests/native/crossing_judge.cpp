// SPDX-License-Identifier: GPL-3.0-or-later
#include "crossing_judge.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <stdexcept>

namespace tolvol {

CrossingPairs crossings_by_cgal(const TriangleMesh& mesh) {
  using Surface = CGAL::Surface_mesh<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3>;
  Surface surface;
  for (const glm::dvec3& p : mesh.vertices) surface.add_vertex({p.x, p.y, p.z});
  for (const glm::uvec3& t : mesh.triangles) {
    using Vertex = Surface::Vertex_index;
    if (surface.add_face(Vertex(t.x), Vertex(t.y), Vertex(t.z)) == Surface::null_face()) {
      throw std::invalid_argument("the mesh is not an oriented manifold");
    }
  }
  std::vector<std::pair<Surface::Face_index, Surface::Face_index>> pairs;
  CGAL::Polygon_mesh_processing::self_intersections(surface, std::back_inserter(pairs));
  CrossingPairs sorted;
  for (const auto& [a, b] : pairs) sorted.emplace_back(std::min<std::uint32_t>(a, b), std::max<std::uint32_t>(a, b));
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

bool cross_by_cgal(const Corners& a, const Corners& b) {
  using Exact = CGAL::Exact_predicates_exact_constructions_kernel;
  const auto point = [](const glm::dvec3& p) { return Exact::Point_3(p.x, p.y, p.z); };
  const auto triangle = [&](const Corners& t) { return Exact::Triangle_3(point(t[0]), point(t[1]), point(t[2])); };
  const auto shared = [&](const Exact::Point_3& p) {
    const auto is_corner = [&](const Corners& t) {
      return std::any_of(t.begin(), t.end(), [&](const glm::dvec3& corner) { return point(corner) == p; });
    };
    return is_corner(a) && is_corner(b);
  };
  const auto common = CGAL::intersection(triangle(a), triangle(b));
  if (!common) return false;
  if (const auto* p = boost::get<Exact::Point_3>(&*common)) return !shared(*p);
  if (const auto* s = boost::get<Exact::Segment_3>(&*common)) return !(shared(s->source()) && shared(s->target()));
  return true;
}

}  // namespace tolvol
