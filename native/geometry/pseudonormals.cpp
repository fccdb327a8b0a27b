// SPDX-License-Identifier: GPL-3.0-or-later
// [Baerentzen and Aanaes 2005] define the normals for closed manifolds; the rules for other meshes are this file's own.
// The faces at an edge are found among the half-edges of its lower end.
#include "geometry/pseudonormals.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "base/call.h"
#include "base/union_find.h"
#include "geometry/weld.h"

namespace tolvol {
namespace {

// A face lower than this share of the largest coordinate is flat. Mapping into the frame moves a corner by up to 1e-15
// of that coordinate, which turns the normal of a face of this height by a thousandth.
constexpr double kFlatFace = 1e-12;

struct HalfEdge {
  std::uint32_t other;  ///< is the higher end
  std::uint32_t place;  ///< is 3 * triangle + the corner at which it starts

  std::uint32_t triangle() const { return place / 3; }
  std::uint32_t corner() const { return place % 3; }
};

/// Holds half-edges by their lower end. Those of v are [first[v], first[v + 1]), sorted by the higher end.
struct HalfEdges {
  std::vector<std::uint32_t> first;
  std::vector<HalfEdge> sorted;
};

HalfEdges half_edges(const std::vector<glm::uvec3>& corners, std::size_t vertices) {
  HalfEdges result;
  result.first.assign(vertices + 1, 0);
  result.sorted.resize(3 * corners.size());
  for (const glm::uvec3& t : corners) {
    for (int k = 0; k < 3; ++k) ++result.first[std::min(t[k], t[(k + 1) % 3]) + 1];
  }
  for (std::size_t v = 0; v < vertices; ++v) result.first[v + 1] += result.first[v];
  std::vector<std::uint32_t> next(result.first.begin(), result.first.end() - 1);
  for (std::uint32_t i = 0; i < corners.size(); ++i) {
    poll_at(i);
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t a = corners[i][k], b = corners[i][(k + 1) % 3];
      result.sorted[next[std::min(a, b)]++] = {std::max(a, b), 3 * i + k};
    }
  }
  std::size_t compared = 0;
  for (std::size_t v = 0; v < vertices; ++v) {
    poll_at(v);
    std::sort(result.sorted.begin() + result.first[v], result.sorted.begin() + result.first[v + 1],
              [&](const HalfEdge& a, const HalfEdge& b) {
                poll_at(++compared);
                return a.other != b.other ? a.other < b.other : a.place < b.place;
              });
  }
  return result;
}

/// Calls visit() with the span of the half-edges at one edge, for every edge whose ends differ.
template <class Visit>
void for_edges(const HalfEdges& edges, Visit&& visit) {
  for (std::uint32_t v = 0; v + 1 < edges.first.size(); ++v) {
    poll_at(v);
    for (std::uint32_t i = edges.first[v], end; i < edges.first[v + 1]; i = end) {
      for (end = i + 1; end < edges.first[v + 1] && edges.sorted[end].other == edges.sorted[i].other;) ++end;
      if (edges.sorted[i].other != v) visit(std::span(edges.sorted).subspan(i, end - i));
    }
  }
}

std::vector<glm::uvec3> welded_corners(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> welded = weld_equal_positions(mesh.vertices);
  std::vector<glm::uvec3> corners = mesh.triangles;
  for (glm::uvec3& t : corners) t = {welded[t.x], welded[t.y], welded[t.z]};
  return corners;
}

/// Tells whether two faces run along an edge in opposite directions, and no other face has it.
bool closed_at(std::span<const HalfEdge> edge, const std::vector<glm::uvec3>& corners) {
  const auto start = [&](const HalfEdge& e) { return corners[e.triangle()][e.corner()]; };
  return edge.size() == 2 && start(edge[0]) != start(edge[1]);
}

/// Returns the angle of a triangle at its corner k.
double angle(const TriangleMesh& mesh, const glm::uvec3& t, int k) {
  const glm::dvec3 p = mesh.vertices[t[k]], a = mesh.vertices[t[(k + 1) % 3]] - p,
                   b = mesh.vertices[t[(k + 2) % 3]] - p;
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

}  // namespace

bool is_closed(const TriangleMesh& mesh) {
  const std::vector<glm::uvec3> corners = welded_corners(mesh);
  bool closed = true;
  for_edges(half_edges(corners, mesh.vertices.size()),
            [&](std::span<const HalfEdge> edge) { closed = closed && closed_at(edge, corners); });
  return closed;
}

Pseudonormals::Pseudonormals(const TriangleMesh& mesh)
    : corners_(welded_corners(mesh)), vertex_(mesh.vertices.size(), glm::dvec3(0)), edge_(mesh.triangles.size()) {
  double magnitude = 0;
  for (const glm::uvec3& t : corners_) {
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 p = glm::abs(mesh.vertices[t[k]]);
      magnitude = std::max({magnitude, p.x, p.y, p.z});
    }
  }

  face_.reserve(corners_.size());
  std::vector<bool> flat(corners_.size());
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    poll_at(i);
    const glm::uvec3& t = corners_[i];
    const glm::dvec3 ab = mesh.vertices[t.y] - mesh.vertices[t.x], ac = mesh.vertices[t.z] - mesh.vertices[t.x];
    const glm::dvec3 n = glm::cross(ab, ac);
    const double longest = std::sqrt(std::max({glm::dot(ab, ab), glm::dot(ac, ac), glm::dot(ac - ab, ac - ab)}));
    flat[i] = !(glm::length(n) > kFlatFace * magnitude * longest);
    face_.push_back(flat[i] ? glm::dvec3(0) : n / glm::length(n));
  }

  const HalfEdges edges = half_edges(corners_, mesh.vertices.size());
  for_edges(edges, [&](std::span<const HalfEdge> edge) {
    glm::dvec3 sum(0);
    for (const HalfEdge& e : edge) sum += face_[e.triangle()];
    for (const HalfEdge& e : edge) edge_[e.triangle()][e.corner()] = sum;
    closed_ = closed_ && closed_at(edge, corners_);
  });
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    poll_at(i);
    for (int k = 0; k < 3; ++k) vertex_[corners_[i][k]] += angle(mesh, corners_[i], k) * face_[i];
  }
  if (std::find(flat.begin(), flat.end(), true) == flat.end()) return;

  // Flat faces that share an edge form one group, a crease between the faces around it.
  UnionFind group(corners_.size());
  const auto flat_at = [&](std::span<const HalfEdge> edge) {
    return std::find_if(edge.begin(), edge.end(), [&](const HalfEdge& e) { return flat[e.triangle()]; });
  };
  for_edges(edges, [&](std::span<const HalfEdge> edge) {
    for (const HalfEdge& e : edge) {
      if (flat[e.triangle()]) group.join(flat_at(edge)->triangle(), e.triangle());
    }
  });
  // Each face around a crease counts by the length of its edge, so that both sides weigh the same however they are cut.
  std::vector<glm::dvec3> crease(corners_.size(), glm::dvec3(0));
  for_edges(edges, [&](std::span<const HalfEdge> edge) {
    const auto found = flat_at(edge);
    if (found == edge.end()) return;
    const glm::uvec3& t = corners_[found->triangle()];
    const glm::dvec3 along = mesh.vertices[t[(found->corner() + 1) % 3]] - mesh.vertices[t[found->corner()]];
    crease[group.find(found->triangle())] += glm::length(along) * edge_[found->triangle()][found->corner()];
  });
  for_edges(edges, [&](std::span<const HalfEdge> edge) {
    if (flat_at(edge) == edge.end()) return;
    const glm::dvec3 normal = crease[group.find(flat_at(edge)->triangle())];
    for (const HalfEdge& e : edge) edge_[e.triangle()][e.corner()] = normal;
  });
  // A vertex in the middle of an edge of a flat face lies within the crease. At the ends of the edge nothing is
  // missing.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> within;
  for (std::uint32_t i = 0; i < corners_.size(); ++i) {
    if (!flat[i]) continue;
    face_[i] = crease[group.find(i)];
    for (int k = 0; k < 3; ++k) {
      if (angle(mesh, corners_[i], k) > std::numbers::pi / 2) within.emplace_back(corners_[i][k], i);
    }
  }
  for (const auto& [vertex, face] : within) vertex_[vertex] = glm::dvec3(0);
  for (const auto& [vertex, face] : within) vertex_[vertex] += face_[face];
}

const glm::dvec3& Pseudonormals::at(std::uint32_t triangle, const glm::dvec3& weights) const {
  const glm::uvec3& t = corners_[triangle];
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3, last = (k + 2) % 3;
    if (weights[last] != 0) continue;
    if (weights[next] == 0 || t[k] == t[next]) return vertex_[t[k]];
    if (weights[k] != 0) return edge_[triangle][k];
  }
  return face_[triangle];
}

}  // namespace tolvol
