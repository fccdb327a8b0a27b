// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/t_junctions.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/call.h"
#include "geometry/triangle_mesh.h"
#include "topology/face_tree.h"

namespace tolvol {
namespace {

constexpr double kUnits = 4;

double largest(const glm::dvec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

/// Whether `p`, which is neither end, lies between the ends.
bool lies_on(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, double unit) {
  const glm::dvec3 edge = b - a, to_p = p - a;
  const double along = glm::dot(edge, to_p), length2 = glm::dot(edge, edge);
  if (!(along > 0 && along < length2)) return false;
  const double reach = kUnits * unit * std::max({largest(a), largest(b), largest(p)});
  const glm::dvec3 away = to_p - along / length2 * edge;
  return glm::dot(away, away) <= reach * reach;
}

bool before(const glm::dvec3& a, const glm::dvec3& b) {
  return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

}  // namespace

std::vector<std::uint32_t> t_junctions(std::span<const glm::dvec3> vertices, std::span<const glm::uvec2> edges,
                                       double unit, Team& team) {
  if (edges.empty()) return {};
  std::vector<std::uint32_t> ends;
  for (const glm::uvec2& e : edges) ends.insert(ends.end(), {e.x, e.y});
  std::ranges::sort(ends);
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());

  std::vector<std::uint32_t> numbers(edges.size());
  std::iota(numbers.begin(), numbers.end(), 0u);
  std::vector<Box> boxes(edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const glm::dvec3 &a = vertices[edges[i].x], &b = vertices[edges[i].y];
    const double room = 2 * kUnits * unit * std::max(largest(a), largest(b));
    boxes[i].add(glm::min(a, b) - room), boxes[i].add(glm::max(a, b) + room);
  }
  const FaceTree tree(numbers, boxes, team);

  std::vector<glm::dvec3> places;
  for (const std::uint32_t v : ends) {
    poll_at(v);
    const glm::dvec3& p = vertices[v];
    Box at;
    at.add(p);
    tree.for_each_meeting(at, [&](std::uint32_t i) {
      const glm::dvec3 &a = vertices[edges[i].x], &b = vertices[edges[i].y];
      if (p != a && p != b && lies_on(p, a, b, unit)) places.insert(places.end(), {p, a, b});
    });
  }
  std::ranges::sort(places, before);
  std::erase_if(ends, [&](std::uint32_t v) { return !std::ranges::binary_search(places, vertices[v], before); });
  return ends;
}

}  // namespace tolvol
