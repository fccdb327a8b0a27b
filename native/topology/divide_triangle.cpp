// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/divide_triangle.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace tolvol {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<VertexBase, CGAL::Constrained_triangulation_face_base_2<Kernel>>;
using Triangulation =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, Structure,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;

/// The cosine of the angle by which a piece may be turned.
constexpr double kLeastCosine = 0.9;

using Edge = std::pair<std::uint32_t, std::uint32_t>;

Edge edge(std::uint32_t a, std::uint32_t b) { return std::minmax(a, b); }

glm::dvec3 normal_of(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) { return glm::cross(b - a, c - a); }

/// The triangulation of the points in the view along `axis`, or nothing if two points are one there or edges cross.
std::optional<Triangulation> triangulation(const TriangleToDivide& t, int axis) {
  Triangulation result;
  std::vector<Triangulation::Vertex_handle> handles;
  for (std::uint32_t i = 0; i < t.points.size(); ++i) {
    const glm::dvec3& p = t.points[i];
    handles.push_back(result.insert(Kernel::Point_2(p[(axis + 1) % 3], p[(axis + 2) % 3])));
    handles.back()->info() = i;
  }
  if (result.number_of_vertices() != t.points.size()) return std::nullopt;
  try {
    std::set<Edge> edges;
    for (std::size_t i = 0; i < t.border.size(); ++i) {
      edges.insert(edge(t.border[i], t.border[(i + 1) % t.border.size()]));
    }
    for (const Edge& e : t.edges) edges.insert(edge(e.first, e.second));
    for (const Edge& e : edges) result.insert_constraint(handles[e.first], handles[e.second]);
  } catch (const Triangulation::Intersection_of_constraints_exception&) {
    return std::nullopt;
  }
  return result;
}

/// The faces of the triangulation within the border.
std::vector<Triangulation::Face_handle> faces_within_border(const TriangleToDivide& t, const Triangulation& all) {
  std::set<Edge> border;
  for (std::size_t i = 0; i < t.border.size(); ++i) {
    border.insert(edge(t.border[i], t.border[(i + 1) % t.border.size()]));
  }
  std::set<Triangulation::Face_handle> outside{all.infinite_face()};
  std::vector<Triangulation::Face_handle> stack{all.infinite_face()};
  while (!stack.empty()) {
    const Triangulation::Face_handle face = stack.back();
    stack.pop_back();
    for (int k = 0; k < 3; ++k) {
      const auto a = face->vertex(Triangulation::ccw(k)), b = face->vertex(Triangulation::cw(k));
      const bool is_border = !all.is_infinite(a) && !all.is_infinite(b) && border.contains(edge(a->info(), b->info()));
      if (!is_border && outside.insert(face->neighbor(k)).second) stack.push_back(face->neighbor(k));
    }
  }
  std::vector<Triangulation::Face_handle> result;
  for (auto face = all.finite_faces_begin(); face != all.finite_faces_end(); ++face) {
    if (!outside.contains(face)) result.push_back(face);
  }
  return result;
}

}  // namespace

std::optional<std::vector<glm::uvec3>> divide(const TriangleToDivide& t, double height) {
  // Rounding must not let the normal depend on which corner is the first.
  glm::uvec3 sorted = t.corners;
  std::sort(&sorted.x, &sorted.x + 3);
  glm::dvec3 normal = normal_of(t.points[sorted.x], t.points[sorted.y], t.points[sorted.z]);
  const auto after = [&](std::uint32_t a, std::uint32_t b) {
    return (a == t.corners.x && b == t.corners.y) || (a == t.corners.y && b == t.corners.z) ||
           (a == t.corners.z && b == t.corners.x);
  };
  if (!after(sorted.x, sorted.y)) normal = -normal;
  const double length = glm::length(normal);
  if (!(length > 0)) return std::nullopt;
  const glm::dvec3 size = glm::abs(normal);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::optional<Triangulation> all = triangulation(t, axis);
  if (!all) return std::nullopt;
  std::vector<glm::uvec3> pieces;
  std::vector<bool> used(t.points.size(), false);
  for (const Triangulation::Face_handle face : faces_within_border(t, *all)) {
    glm::uvec3 piece(face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info());
    if (normal[axis] < 0) std::swap(piece.y, piece.z);
    const glm::dvec3 &a = t.points[piece.x], &b = t.points[piece.y], &c = t.points[piece.z];
    const glm::dvec3 own = normal_of(a, b, c);
    const double area = glm::length(own);
    const double longest = std::max({glm::length(b - a), glm::length(c - b), glm::length(a - c)});
    if (!(area >= height * longest) || !(glm::dot(own, normal) >= kLeastCosine * area * length)) return std::nullopt;
    for (int k = 0; k < 3; ++k) used[piece[k]] = true;
    pieces.push_back(piece);
  }
  if (std::ranges::find(used, false) != used.end()) return std::nullopt;
  std::ranges::sort(pieces, {}, [](const glm::uvec3& p) { return std::array{p.x, p.y, p.z}; });
  return pieces;
}

}  // namespace tolvol
