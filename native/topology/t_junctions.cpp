// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/t_junctions.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "base/call.h"
#include "base/union_find.h"
#include "geometry/closest_point.h"
#include "geometry/hierarchy.h"

namespace tolvol {
namespace {

constexpr double kUnits = 4;
constexpr std::size_t kBlock = 256;

double largest(const glm::dvec3& p) { return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }

bool before(const glm::dvec3& a, const glm::dvec3& b) {
  return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

/// Whether `p` lies between the ends, and not where one of them may have been before rounding.
bool lies_on(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, double unit) {
  const glm::dvec3 edge = b - a, to_p = p - a;
  const double along = glm::dot(edge, to_p), length2 = glm::dot(edge, edge);
  if (!(along > 0 && along < length2)) return false;
  const double reach = kUnits * unit * std::max({largest(a), largest(b), largest(p)});
  const glm::dvec3 away = to_p - along / length2 * edge;
  return glm::dot(away, away) <= reach * reach && glm::length(p - a) > reach && glm::length(p - b) > reach;
}

class TJunctions {
 public:
  TJunctions(TriangleMesh mesh, std::span<const glm::uvec2> open, double unit) : mesh_(std::move(mesh)), unit_(unit) {
    for (const glm::dvec3& p : mesh_.vertices) farthest_ = std::max(farthest_, largest(p));
    // Squares of coordinates stay within double in a mesh of a size of about 1.
    const double scale = farthest_ > 0 ? std::ldexp(1.0, -std::clamp(std::ilogb(farthest_), -1000, 1000)) : 1;
    for (glm::dvec3& p : mesh_.vertices) p *= scale;
    farthest_ *= scale;
    std::vector<bool> is_end(mesh_.vertices.size());
    for (const glm::uvec2& e : open) {
      is_end[e.x] = is_end[e.y] = true;
      open_.emplace_back(std::minmax(e.x, e.y));
    }
    std::ranges::sort(open_);
    // A triangle that is no more than a segment joins what lies along it.
    UnionFind joined(mesh_.vertices.size());
    std::erase_if(mesh_.triangles, [&](const glm::uvec3& t) {
      for (int k = 0; k < 3; ++k) {
        if (is_end[t[k]]) around_.emplace_back(t[k], t);
      }
      if (!is_segment(t)) return false;
      joined.join(t.x, t.y), joined.join(t.x, t.z);
      return true;
    });
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) joined_.push_back(joined.find(v));
    std::ranges::stable_sort(around_, {}, &std::pair<std::uint32_t, glm::uvec3>::first);
  }

  /// The places of what holds the T-junctions together.
  std::vector<glm::dvec3> places(Team& team) const {
    std::vector<std::uint32_t> ends;
    for (const auto& [vertex, triangle] : around_) {
      if (ends.empty() || ends.back() != vertex) ends.push_back(vertex);
    }
    const Hierarchy hierarchy(mesh_);
    std::vector<std::vector<glm::dvec3>> found((ends.size() + kBlock - 1) / kBlock);
    team.run(ends.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) add(ends[i], hierarchy, found[begin / kBlock]);
    });
    std::vector<glm::dvec3> result;
    for (const std::vector<glm::dvec3>& f : found) result.insert(result.end(), f.begin(), f.end());
    return result;
  }

  /// The vertices at these places.
  std::vector<std::uint32_t> at(std::vector<glm::dvec3> places) const {
    std::vector<std::uint32_t> result;
    if (places.empty()) return result;
    std::ranges::sort(places, before);
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) {
      poll_at(v);
      if (std::ranges::binary_search(places, place(v), before)) result.push_back(v);
    }
    return result;
  }

 private:
  using Edge = std::pair<std::uint32_t, std::uint32_t>;  // the lower vertex first

  /// An edge that a vertex lies on, as a side of one triangle.
  struct Contact {
    Edge edge;
    bool in_plane;  // of that triangle, all faces around the vertex

    auto operator<=>(const Contact& other) const = default;
  };

  const glm::dvec3& place(std::uint32_t vertex) const { return mesh_.vertices[vertex]; }

  double reach(const glm::uvec3& t) const {
    return kUnits * unit_ * std::max({largest(place(t.x)), largest(place(t.y)), largest(place(t.z))});
  }

  bool is_segment(const glm::uvec3& t) const {
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 &a = place(t[k]), &b = place(t[(k + 1) % 3]), &c = place(t[(k + 2) % 3]);
      if (a == b || lies_on(c, a, b, unit_)) return true;
    }
    return false;
  }

  /// Whether all faces around an end of an open edge lie in the plane of a triangle.
  bool lies_in_plane(std::uint32_t end, const glm::uvec3& t) const {
    const glm::dvec3 normal = glm::cross(place(t.y) - place(t.x), place(t.z) - place(t.x));
    const auto faces = std::ranges::equal_range(around_, end, {}, &std::pair<std::uint32_t, glm::uvec3>::first);
    return std::ranges::all_of(faces, [&](const auto& face) {
      const double room = std::max(reach(t), reach(face.second)) * glm::length(normal);
      for (int k = 0; k < 3; ++k) {
        if (std::abs(glm::dot(normal, place(face.second[k]) - place(t.x))) > room) return false;
      }
      return true;
    });
  }

  bool is_joined(std::uint32_t vertex, const Edge& edge) const {
    return joined_[vertex] == joined_[edge.first] && joined_[vertex] == joined_[edge.second];
  }

  /// Adds the places of the T-junctions of a vertex.
  void add(std::uint32_t vertex, const Hierarchy& hierarchy, std::vector<glm::dvec3>& places) const {
    const glm::dvec3& p = place(vertex);
    std::vector<Contact> contacts;
    hierarchy.for_each_within(p, kUnits * unit_ * farthest_, [&](std::uint32_t index) {
      const glm::uvec3& t = mesh_.triangles[index];
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (!lies_on(p, place(a), place(b), unit_)) continue;
        contacts.push_back({std::minmax(a, b), lies_in_plane(vertex, t)});
        return;
      }
      if (!lies_inside(p, t) || lies_in_plane(vertex, t)) return;
      places.insert(places.end(), {p, place(t.x), place(t.y), place(t.z)});
    });
    // The sides on one edge stand together, and those in whose plane the faces lie are first.
    std::ranges::sort(contacts, std::greater<>());
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const auto& [edge, lies_upon_a_face] = contacts[i];
      if ((i > 0 && contacts[i - 1].edge == edge) || is_joined(vertex, edge)) continue;
      const bool is_open = std::ranges::binary_search(open_, edge);
      if (is_open || !lies_upon_a_face) places.insert(places.end(), {p, place(edge.first), place(edge.second)});
    }
  }

  /// Whether `p`, which lies on none of its edges, lies in a triangle and at none of its corners.
  bool lies_inside(const glm::dvec3& p, const glm::uvec3& t) const {
    const glm::dvec3 &a = place(t.x), &b = place(t.y), &c = place(t.z);
    const double room = std::max(reach(t), kUnits * unit_ * largest(p));
    if (std::min({glm::length(p - a), glm::length(p - b), glm::length(p - c)}) <= room) return false;
    return closest_point(p, a, b, c).distance_squared <= room * room;
  }

  TriangleMesh mesh_;  // without the triangles that are no more than a segment
  double unit_;
  double farthest_ = 0;  // the largest coordinate
  std::vector<Edge> open_;
  std::vector<std::pair<std::uint32_t, glm::uvec3>> around_;  // the ends of open edges, with the triangles around them
  std::vector<std::uint32_t> joined_;  // per vertex: a number that vertices have in common which segments join
};

}  // namespace

std::vector<std::uint32_t> t_junctions(TriangleMesh mesh, std::span<const glm::uvec2> open, double unit, Team& team) {
  if (open.empty()) return {};
  const TJunctions junctions(std::move(mesh), open, unit);
  return junctions.at(junctions.places(team));
}

}  // namespace tolvol
