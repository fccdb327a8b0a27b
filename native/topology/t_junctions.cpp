// SPDX-License-Identifier: GPL-3.0-or-later
#include "topology/t_junctions.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include "base/call.h"
#include "base/union_find.h"
#include "geometry/closest_point.h"
#include "geometry/hierarchy.h"
#include "geometry/lengths.h"
#include "geometry/weld.h"
#include "topology/face_tree.h"
#include "topology/near_points.h"

namespace tolvol {
namespace {

/// The rounding of vertices that are so many times farther from the origin than the others does not count.
constexpr double kFar = 8;
constexpr std::size_t kBlock = 256;
/// Places where a search visits more nodes of the hierarchy than this are looked at together.
constexpr std::size_t kMostNodes = 128;
/// Open edges from a place where more vertices are than this are not compared with other edges: the triangles there are
/// in the way of each other.
constexpr std::uint32_t kCrowd = 100;

bool before(const glm::dvec3& a, const glm::dvec3& b) {
  return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

class Finder {
 public:
  Finder(TriangleMesh mesh, std::span<const glm::uvec2> open, double unit) : mesh_(std::move(mesh)), unit_(unit) {
    double farthest = 0;
    for (const glm::dvec3& p : mesh_.vertices) farthest = std::max(farthest, largest(p));
    // Squares of coordinates stay within double in a mesh of a size of about 1.
    const double scale = farthest > 0 ? std::ldexp(1.0, -std::clamp(std::ilogb(farthest), -1000, 1000)) : 1;
    for (glm::dvec3& p : mesh_.vertices) p *= scale;
    std::vector<double> sizes;
    sizes.reserve(mesh_.vertices.size());
    for (const glm::dvec3& p : mesh_.vertices) sizes.push_back(largest(p));
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    usual_ = *middle;
    is_end_.resize(mesh_.vertices.size());
    for (const glm::uvec2& e : open) {
      is_end_[e.x] = is_end_[e.y] = true;
      open_.emplace_back(std::minmax(e.x, e.y));
    }
    std::ranges::sort(open_);
    // A triangle that is no more than a segment joins what lies along it.
    UnionFind joined(mesh_.vertices.size());
    std::erase_if(mesh_.triangles, [&](const glm::uvec3& t) {
      for (int k = 0; k < 3; ++k) {
        if (is_end_[t[k]]) around_.emplace_back(t[k], t);
      }
      if (!is_segment(t)) return false;
      joined.join(t.x, t.y), joined.join(t.x, t.z);
      return true;
    });
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) joined_.push_back(joined.find(v));
    std::ranges::stable_sort(around_, {}, &Around::first);
  }

  TJunctions find(Team& team) const {
    std::vector<std::uint32_t> ends;
    for (const auto& [vertex, triangle] : around_) {
      if (ends.empty() || ends.back() != vertex) ends.push_back(vertex);
    }
    TJunctions result;
    result.vertices = at_places<TJunction>(ends, mesh_, team,
                                           [&](std::uint32_t vertex, std::span<const std::uint32_t> near,
                                               std::vector<TJunction>& junctions) { add(vertex, near, junctions); });
    add_on_open_edges(team, result.vertices);
    add_across(team, result);
    return result;
  }

  /// The vertices at the places of what holds these together.
  std::vector<std::uint32_t> holding(const TJunctions& junctions) const {
    std::vector<std::uint32_t> result;
    if (junctions.empty()) return result;
    std::vector<glm::dvec3> places;
    for (const auto& [vertex, on] : junctions.vertices) {
      places.insert(places.end(), {place(vertex), place(on.x), place(on.y), place(on.z)});
    }
    for (const std::uint32_t v : junctions.across) places.push_back(place(v));
    std::ranges::sort(places, before);
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) {
      poll_at(v);
      if (std::ranges::binary_search(places, place(v), before)) result.push_back(v);
    }
    return result;
  }

 private:
  using Edge = std::pair<std::uint32_t, std::uint32_t>;  // the lower vertex first
  using Around = std::pair<std::uint32_t, glm::uvec3>;   // a vertex, and a triangle around it

  /// An edge that a vertex lies on, as a side of one triangle.
  struct Contact {
    Edge edge;
    bool in_plane;  // of that triangle, all faces around the vertex
  };

  const glm::dvec3& place(std::uint32_t vertex) const { return mesh_.vertices[vertex]; }

  /// No vertex farther than this is on anything, whatever else the mesh has far away.
  double most_reach(const glm::dvec3& p) const { return kTJunctionUnits * unit_ * kFar * std::max(usual_, largest(p)); }
  /// How far rounding may have put `p` from what has these corners.
  double reach(const glm::dvec3& p, const glm::uvec3& t) const {
    const double size = std::max({largest(p), largest(place(t.x)), largest(place(t.y)), largest(place(t.z))});
    return std::min(kTJunctionUnits * unit_ * size, most_reach(p));
  }

  /// Whether `p` lies between the ends, and not where one of them may have been before rounding.
  bool lies_on(const glm::dvec3& p, std::uint32_t from, std::uint32_t to) const {
    const glm::dvec3 &a = place(from), &b = place(to);
    const glm::dvec3 edge = b - a, to_p = p - a;
    const double along = glm::dot(edge, to_p), length2 = glm::dot(edge, edge);
    if (!(along > 0 && along < length2)) return false;
    const double room = reach(p, {from, to, to});
    const glm::dvec3 away = to_p - along / length2 * edge;
    return glm::dot(away, away) <= room * room && glm::length(p - a) > room && glm::length(p - b) > room;
  }

  bool is_segment(const glm::uvec3& t) const {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (place(a) == place(b) || lies_on(place(t[(k + 2) % 3]), a, b)) return true;
    }
    return false;
  }

  /// Whether all faces around a vertex lie in the plane of a triangle. `around` holds them, sorted by their vertices.
  bool lies_in_plane(std::uint32_t vertex, const glm::uvec3& t, const std::vector<Around>& around) const {
    const glm::dvec3 normal = glm::cross(place(t.y) - place(t.x), place(t.z) - place(t.x));
    auto face = std::ranges::lower_bound(around, vertex, {}, &Around::first);
    for (; face != around.end() && face->first == vertex; ++face) {
      const double room = std::max(reach(place(vertex), t), reach(place(vertex), face->second)) * glm::length(normal);
      for (int k = 0; k < 3; ++k) {
        if (std::abs(glm::dot(normal, place(face->second[k]) - place(t.x))) > room) return false;
      }
    }
    return true;
  }

  bool is_joined(std::uint32_t vertex, const Edge& edge) const {
    return joined_[vertex] == joined_[edge.first] && joined_[vertex] == joined_[edge.second];
  }

  /// Puts vertices at one place together. Returns where the vertices of each place begin, and the number of all.
  std::vector<std::size_t> sort_by_place(std::vector<std::uint32_t>& vertices) const {
    std::ranges::stable_sort(vertices, [&](std::uint32_t a, std::uint32_t b) { return before(place(a), place(b)); });
    std::vector<std::size_t> starts;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (i == 0 || place(vertices[i]) != place(vertices[i - 1])) starts.push_back(i);
    }
    starts.push_back(vertices.size());
    return starts;
  }

  /// Finds the triangles that a vertex at `p` may lie on. Those with a corner there are left out: where thousands of
  /// vertices are at one place, each of them would look at the triangles of all others. Returns false, with only some
  /// of them, if there is too much to look at.
  bool find_near(const glm::dvec3& p, const Hierarchy& hierarchy, std::span<const glm::uvec3> triangles,
                 std::vector<std::uint32_t>& near) const {
    near.clear();
    std::size_t turn = 0, nodes = 0;
    hierarchy.for_each_within(
        p, most_reach(p),
        [&](std::uint32_t index) {
          poll_at(++turn);
          if (!has_corner_at(p, triangles[index])) near.push_back(index);
        },
        [&](std::uint32_t) { return ++nodes <= kMostNodes; });
    return nodes <= kMostNodes;
  }

  bool has_corner_at(const glm::dvec3& p, const glm::uvec3& t) const {
    return place(t.x) == p || place(t.y) == p || place(t.z) == p;
  }

  /// Calls add(vertex, triangles near it, what is found) for all these vertices, place by place, in several threads
  /// but for crowded places, which come last. `mesh` has the vertices of mesh_. Returns all that is found.
  template <class Found, class Add>
  std::vector<Found> at_places(std::vector<std::uint32_t> vertices, const TriangleMesh& mesh, Team& team,
                               Add&& add) const {
    const std::vector<std::size_t> starts = sort_by_place(vertices);
    const Hierarchy hierarchy(mesh);
    std::vector<std::vector<Found>> found((starts.size() + kBlock - 1) / kBlock + 1);
    std::vector<std::vector<std::size_t>> crowded(found.size());
    const auto add_all = [&](std::size_t i, std::span<const std::uint32_t> near, std::vector<Found>& to) {
      for (std::size_t k = starts[i]; k < starts[i + 1]; ++k) add(vertices[k], near, to);
    };
    team.run(starts.size() - 1, kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint32_t> near;
      for (std::size_t i = begin; i < end; ++i) {
        if (find_near(place(vertices[starts[i]]), hierarchy, mesh.triangles, near)) {
          add_all(i, near, found[begin / kBlock]);
        } else {
          crowded[begin / kBlock].push_back(i);
        }
      }
    });
    std::vector<std::size_t> rest;
    std::vector<glm::dvec3> points;
    std::vector<double> reach;
    for (const std::vector<std::size_t>& block : crowded) rest.insert(rest.end(), block.begin(), block.end());
    for (const std::size_t i : rest) {
      points.push_back(place(vertices[starts[i]]));
      reach.push_back(most_reach(points.back()));
    }
    std::vector<std::uint32_t> near;
    for_each_near(points, reach, mesh, [&](std::uint32_t point, std::span<const std::uint32_t> triangles) {
      near.clear();
      std::ranges::copy_if(triangles, std::back_inserter(near),
                           [&](std::uint32_t t) { return !has_corner_at(points[point], mesh.triangles[t]); });
      add_all(rest[point], near, found.back());
    });
    std::vector<Found> result;
    for (const std::vector<Found>& f : found) result.insert(result.end(), f.begin(), f.end());
    return result;
  }

  /// Adds the T-junctions of a vertex with the triangles near it.
  void add(std::uint32_t vertex, std::span<const std::uint32_t> near, std::vector<TJunction>& junctions) const {
    const glm::dvec3& p = place(vertex);
    std::vector<Contact> contacts;
    for (std::size_t i = 0; i < near.size(); ++i) {
      poll_at(i);
      const glm::uvec3& t = mesh_.triangles[near[i]];
      bool touches = false;
      for (int k = 0; k < 3 && !touches; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        touches = lies_on(p, a, b);
        if (touches) contacts.push_back({std::minmax(a, b), lies_in_plane(vertex, t, around_)});
      }
      if (touches || !lies_inside(p, t) || lies_in_plane(vertex, t, around_)) continue;
      junctions.push_back({vertex, t});
    }
    // The sides on one edge stand together, and those in whose plane the faces lie are first.
    std::ranges::sort(contacts, std::greater<>(), [](const Contact& c) { return std::pair(c.edge, c.in_plane); });
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const auto& [edge, lies_upon_a_face] = contacts[i];
      if ((i > 0 && contacts[i - 1].edge == edge) || is_joined(vertex, edge)) continue;
      const bool is_open = std::ranges::binary_search(open_, edge);
      if (is_open || !lies_upon_a_face) junctions.push_back({vertex, {edge.first, edge.second, edge.second}});
    }
  }

  /// A vertex at no open edge, a triangle with an open edge that it lies on, and that edge.
  struct OnOpenEdge {
    std::uint32_t vertex;
    glm::uvec3 triangle;
    Edge edge;
  };

  /// Adds the T-junctions of vertices at no open edge that lie on one.
  void add_on_open_edges(Team& team, std::vector<TJunction>& junctions) const {
    const auto is_open = [&](std::uint32_t a, std::uint32_t b) {
      return is_end_[a] && is_end_[b] && std::ranges::binary_search(open_, Edge(std::minmax(a, b)));
    };
    TriangleMesh rim{mesh_.vertices, {}};
    for (const glm::uvec3& t : mesh_.triangles) {
      if (is_open(t.x, t.y) || is_open(t.y, t.z) || is_open(t.z, t.x)) rim.triangles.push_back(t);
    }
    if (rim.triangles.empty()) return;
    std::vector<std::uint32_t> inner;
    const std::vector<bool> used = used_vertices(mesh_.vertices.size(), mesh_.triangles);
    for (std::uint32_t v = 0; v < mesh_.vertices.size(); ++v) {
      if (used[v] && !is_end_[v]) inner.push_back(v);
    }
    const auto add = [&](std::uint32_t v, std::span<const std::uint32_t> near, std::vector<OnOpenEdge>& found) {
      for (const std::uint32_t index : near) {
        const glm::uvec3& t = rim.triangles[index];
        for (int k = 0; k < 3; ++k) {
          const std::uint32_t a = t[k], b = t[(k + 1) % 3];
          if (!is_open(a, b) || !lies_on(place(v), a, b) || is_joined(v, std::minmax(a, b))) continue;
          found.push_back({v, t, std::minmax(a, b)});
        }
      }
    };
    const std::vector<OnOpenEdge> found = at_places<OnOpenEdge>(inner, rim, team, add);
    std::vector<bool> is_found(mesh_.vertices.size());
    for (const OnOpenEdge& f : found) is_found[f.vertex] = true;
    std::vector<Around> around;
    for (const glm::uvec3& t : mesh_.triangles) {
      for (int k = 0; k < 3; ++k) {
        if (is_found[t[k]]) around.emplace_back(t[k], t);
      }
    }
    std::ranges::stable_sort(around, {}, &Around::first);
    for (const OnOpenEdge& f : found) {
      if (lies_in_plane(f.vertex, f.triangle, around)) continue;
      junctions.push_back({f.vertex, {f.edge.first, f.edge.second, f.edge.second}});
    }
  }

  /// Adds open edges that lie across other edges. Faces without a vertex on the edge meet it there.
  void add_across(Team& team, TJunctions& junctions) const {
    const std::vector<std::uint32_t> first = weld_equal_positions(mesh_.vertices, team);
    std::vector<std::uint32_t> touching(first.size(),
                                        0);  // by the first vertex at each place: vertices that it touches
    for (std::uint32_t v = 0; v < first.size(); ++v) touching[first[v]] += first[v] != v;
    for (const TJunction& j : junctions.vertices) ++touching[first[j.vertex]];
    std::vector<Around> edges;  // by the number among the open edges: the triangle at it
    for (std::uint32_t i = 0; i < open_.size(); ++i) {
      const std::uint32_t a = open_[i].first, b = open_[i].second;
      const std::uint32_t at_a = touching[first[a]], at_b = touching[first[b]];
      if (at_a == 0 || at_b == 0 || std::max(at_a, at_b) > kCrowd) continue;
      auto face = std::ranges::lower_bound(around_, a, {}, &Around::first);
      for (; face != around_.end() && face->first == a; ++face) {
        const glm::uvec3& t = face->second;
        if (t.x == b || t.y == b || t.z == b) edges.emplace_back(i, t);
      }
    }
    if (edges.empty()) return;
    std::vector<std::uint32_t> all(mesh_.triangles.size());
    std::vector<Box> boxes(all.size());
    for (std::uint32_t i = 0; i < all.size(); ++i) {
      all[i] = i;
      for (int k = 0; k < 3; ++k) boxes[i].add(place(mesh_.triangles[i][k]));
    }
    const FaceTree tree(all, boxes, team);
    std::vector<std::vector<std::uint32_t>> found((edges.size() + kBlock - 1) / kBlock);
    team.run(edges.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t a = open_[edges[i].first].first, b = open_[edges[i].first].second;
        const double most = std::min(most_reach(place(a)), most_reach(place(b)));
        const auto may = [&](const Box& box) { return meets(place(a), place(b), box, most); };
        tree.for_each_where(may, [&](std::uint32_t t) { add_across(a, b, edges[i].second, t, found[begin / kBlock]); });
      }
    });
    for (const std::vector<std::uint32_t>& f : found) {
      junctions.across.insert(junctions.across.end(), f.begin(), f.end());
    }
  }

  /// Adds the ends of the edge (a, b) of a face and of an edge of another triangle that it lies across.
  void add_across(std::uint32_t a, std::uint32_t b, const glm::uvec3& face, std::uint32_t triangle,
                  std::vector<std::uint32_t>& across) const {
    poll();
    const glm::uvec3& t = mesh_.triangles[triangle];
    for (int k = 0; k < 3; ++k) {
      if (!crosses(a, b, t[k], t[(k + 1) % 3])) continue;
      const glm::dvec3 normal = glm::cross(place(t.y) - place(t.x), place(t.z) - place(t.x));
      bool is_in_plane = true;
      for (int c = 0; c < 3; ++c) {
        const double height = std::abs(glm::dot(normal, place(face[c]) - place(t.x)));
        is_in_plane = is_in_plane && height <= reach(place(face[c]), t) * glm::length(normal);
      }
      if (!is_in_plane) across.insert(across.end(), {a, b, t[k], t[(k + 1) % 3]});
    }
  }

  /// Whether two edges meet between the ends of both.
  bool crosses(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const {
    const glm::dvec3 along = place(b) - place(a), other = place(d) - place(c), between = place(c) - place(a);
    const glm::dvec3 normal = glm::cross(along, other);
    const double square = glm::dot(normal, normal);
    if (!(square > 0)) return false;
    const double s = glm::dot(glm::cross(between, other), normal) / square;
    const double t = glm::dot(glm::cross(between, along), normal) / square;
    if (!(s > 0 && s < 1 && t > 0 && t < 1)) return false;
    const glm::dvec3 p = place(a) + s * along, q = place(c) + t * other;
    const double room = std::min(reach(place(a), {b, c, d}), most_reach(place(c)));
    return glm::length(p - q) <= room && std::min({glm::length(p - place(a)), glm::length(p - place(b)),
                                                   glm::length(q - place(c)), glm::length(q - place(d))}) > room;
  }

  /// Whether a segment meets a box that is larger by `room` on all sides, which is true of every box around such a box.
  static bool meets(const glm::dvec3& a, const glm::dvec3& b, const Box& box, double room) {
    if (box.empty()) return false;
    double from = 0, to = 1;
    for (int k = 0; k < 3; ++k) {
      const double lower = box.lower[k] - room - a[k], upper = box.upper[k] + room - a[k], way = b[k] - a[k];
      if (way == 0) {
        if (lower > 0 || upper < 0) return false;
        continue;
      }
      from = std::max(from, std::min(lower / way, upper / way));
      to = std::min(to, std::max(lower / way, upper / way));
    }
    return from <= to;
  }

  /// Whether `p`, which lies on none of its edges, lies in a triangle and at none of its corners.
  bool lies_inside(const glm::dvec3& p, const glm::uvec3& t) const {
    const glm::dvec3 &a = place(t.x), &b = place(t.y), &c = place(t.z);
    const double room = reach(p, t);
    if (std::min({glm::length(p - a), glm::length(p - b), glm::length(p - c)}) <= room) return false;
    return closest_point(p, a, b, c).distance_squared <= room * room;
  }

  TriangleMesh mesh_;  // without the triangles that are no more than a segment
  double unit_;
  double usual_ = 0;          // the median of the vertices' largest coordinates
  std::vector<bool> is_end_;  // tells for each vertex whether it is an end of an open edge
  std::vector<Edge> open_;
  std::vector<Around> around_;         // the ends of open edges, with the triangles around them
  std::vector<std::uint32_t> joined_;  // per vertex: a number that vertices have in common which segments join
};

}  // namespace

TJunctions find_t_junctions(TriangleMesh mesh, std::span<const glm::uvec2> open, double unit, Team& team) {
  if (open.empty()) return {};
  return Finder(std::move(mesh), open, unit).find(team);
}

std::vector<std::uint32_t> t_junctions(TriangleMesh mesh, std::span<const glm::uvec2> open, double unit, Team& team) {
  if (open.empty()) return {};
  const Finder finder(std::move(mesh), open, unit);
  return finder.holding(finder.find(team));
}

}  // namespace tolvol
