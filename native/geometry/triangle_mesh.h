// SPDX-License-Identifier: GPL-3.0-or-later
/// A triangle mesh as plain arrays, and the conditions that must hold before anything is computed from one.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

namespace tolvol {

struct TriangleMesh {
  std::vector<glm::dvec3> vertices;
  std::vector<glm::uvec3> triangles;
};

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

struct Sphere {
  glm::dvec3 centre;
  double radius;
};

/// The smallest sphere around the centroid of a triangle that has its corners.
inline Sphere sphere_around(const Corners& t) {
  const glm::dvec3 centre = (t[0] + t[1] + t[2]) * (1.0 / 3);
  return {centre, std::max({glm::distance(t[0], centre), glm::distance(t[1], centre), glm::distance(t[2], centre)})};
}

/// An axis-aligned box. It is empty until a point is added.
struct Box {
  glm::dvec3 lower{std::numeric_limits<double>::infinity()};
  glm::dvec3 upper{-std::numeric_limits<double>::infinity()};

  void add(const glm::dvec3& p) {
    lower = glm::min(lower, p);
    upper = glm::max(upper, p);
  }
  void add(const Box& box) {
    lower = glm::min(lower, box.lower);
    upper = glm::max(upper, box.upper);
  }
  bool empty() const { return lower.x > upper.x; }
};

/// Whether two boxes have a point in common; one that is empty has none.
inline bool meet(const Box& a, const Box& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y && b.lower.y <= a.upper.y &&
         a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}

/// Whether a point lies in a box but on none of its sides.
inline bool strictly_inside(const glm::dvec3& p, const Box& box) {
  return box.lower.x < p.x && p.x < box.upper.x && box.lower.y < p.y && p.y < box.upper.y && box.lower.z < p.z &&
         p.z < box.upper.z;
}

/// Throws InvalidInput, naming the first offender, unless every coordinate is finite. O(n).
void require_finite(std::span<const glm::dvec3> vertices);

/// Throws InvalidInput, naming the first offender, unless there is at least one triangle, every index is below
/// `vertices.size()` and every coordinate is finite (unused vertices too). O(n + m).
void validate(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles);

/// Tells for each vertex whether a triangle uses it. O(n + m).
std::vector<bool> used_vertices(std::size_t vertex_count, std::span<const glm::uvec3> triangles);

/// Returns six times the volume that a closed mesh encloses, negative if its faces run the other way round. O(m).
double enclosed_volume(const TriangleMesh& mesh);

}  // namespace tolvol
