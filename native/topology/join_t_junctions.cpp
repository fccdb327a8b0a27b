// SPDX-License-Identifier: GPL-3.0-or-later
// All vertices are put in at once. Where that cannot be, the edges and triangles concerned stay whole, and everything
// is tried again without them, because what is put into one edge is at an edge of other triangles, too.
#include "topology/join_t_junctions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "base/call.h"
#include "geometry/triangle_mesh.h"
#include "geometry/weld.h"
#include "topology/divide_triangle.h"
#include "topology/face_tree.h"
#include "topology/faces_cross.h"
#include "topology/sides.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;
/// The least height of a piece, in lengths that rounding may have moved its corners by.
constexpr double kLeastHeight = 16;
/// After so many tries nothing is put in: each try but the last refuses something.
constexpr int kMostTries = 16;

using Places = std::vector<std::uint32_t>;
using ThreePlaces = std::array<std::uint32_t, 3>;

class Joining {
 public:
  Joining(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
          std::span<const TJunction> junctions, double unit, Team& team)
      : vertices_(vertices),
        triangles_(triangles),
        junctions_(junctions.begin(), junctions.end()),
        unit_(unit),
        team_(team),
        place_(weld_equal_positions(vertices, team)),
        vertex_at_(vertices.size(), kNoVertex) {
    for (const glm::uvec3& t : triangles) {
      for (int k = 0; k < 3; ++k) vertex_at_[place_[t[k]]] = std::min(vertex_at_[place_[t[k]]], t[k]);
    }
  }

  std::optional<JoinedMesh> run() {
    for (int i = 0; i < kMostTries && !junctions_.empty(); ++i) {
      collect();
      JoinedMesh joined = divide_all();
      if (!refused()) refuse_crossings(joined);
      if (!refused()) return joined;
      drop_refused();
    }
    return std::nullopt;
  }

 private:
  /// A place is named by the first vertex there.
  std::uint32_t place(std::uint32_t triangle, int k) const { return place_[triangles_[triangle][k]]; }
  const glm::dvec3& at(std::uint32_t vertex) const { return vertices_[vertex]; }
  ThreePlaces places(const glm::uvec3& t) const {
    ThreePlaces result{place_[t.x], place_[t.y], place_[t.z]};
    std::ranges::sort(result);
    return result;
  }
  std::uint64_t edge_of(const glm::uvec3& on) const { return pair_key(place_[on.x], place_[on.y]); }

  bool refused() const { return !refused_edges_.empty() || !refused_faces_.empty() || !refused_places_.empty(); }

  void drop_refused() {
    std::erase_if(junctions_, [&](const TJunction& j) {
      return refused_places_.contains(place_[j.vertex]) ||
             (j.on_edge() ? refused_edges_.contains(edge_of(j.on)) : refused_faces_.contains(places(j.on)));
    });
    refused_edges_.clear(), refused_faces_.clear(), refused_places_.clear();
  }

  /// Refuses all that was put into a triangle.
  void refuse(std::uint32_t t) {
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t edge = pair_key(place(t, k), place(t, (k + 1) % 3));
      if (on_edge_.contains(edge)) refused_edges_.insert(edge);
    }
    if (in_face_.contains(places(triangles_[t]))) refused_faces_.insert(places(triangles_[t]));
  }

  /// Finds what is to be put in where, and the edges at what is put in.
  void collect() {
    on_edge_.clear(), in_face_.clear(), neighbours_.clear();
    for (const TJunction& j : junctions_) {
      const std::uint32_t p = place_[j.vertex];
      neighbours_.try_emplace(p);
      (j.on_edge() ? on_edge_[edge_of(j.on)] : in_face_[places(j.on)]).push_back(p);
    }
    for (auto& [edge, on_it] : on_edge_) {
      // From the end with the lower number to the other one.
      const glm::dvec3 &a = at(static_cast<std::uint32_t>(edge >> 32)), &b = at(static_cast<std::uint32_t>(edge));
      std::ranges::sort(on_it, {}, [&](std::uint32_t p) { return std::pair(glm::dot(at(p) - a, b - a), p); });
      on_it.erase(std::unique(on_it.begin(), on_it.end()), on_it.end());
    }
    for (auto& [face, in_it] : in_face_) {
      std::ranges::sort(in_it);
      in_it.erase(std::unique(in_it.begin(), in_it.end()), in_it.end());
    }
    Places along;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      poll_at(t);
      for (int k = 0; k < 3; ++k) {
        along.assign(1, place(t, k));
        add_between(t, k, along);
        along.push_back(place(t, (k + 1) % 3));
        for (std::size_t i = 0; i + 1 < along.size(); ++i) {
          add_neighbour(along[i], along[i + 1]), add_neighbour(along[i + 1], along[i]);
        }
      }
    }
    for (auto& [p, others] : neighbours_) {
      std::ranges::sort(others);
      others.erase(std::unique(others.begin(), others.end()), others.end());
    }
  }

  void add_neighbour(std::uint32_t p, std::uint32_t other) {
    const auto found = neighbours_.find(p);
    if (found != neighbours_.end() && other != p) found->second.push_back(other);
  }

  /// Adds what is put into side k of a triangle, from its start to its end.
  void add_between(std::uint32_t t, int k, Places& along) const {
    const std::uint32_t a = place(t, k), b = place(t, (k + 1) % 3);
    const auto found = on_edge_.find(pair_key(a, b));
    if (found == on_edge_.end()) return;
    if (a < b) {
      along.insert(along.end(), found->second.begin(), found->second.end());
    } else {
      along.insert(along.end(), found->second.rbegin(), found->second.rend());
    }
  }

  JoinedMesh divide_all() {
    JoinedMesh joined;
    joined.triangles.assign(triangles_.begin(), triangles_.end());
    joined.parent.resize(triangles_.size());
    joined.is_piece.assign(triangles_.size(), false);
    joined.count = neighbours_.size();
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      poll_at(t);
      joined.parent[t] = t;
      Places border;
      for (int k = 0; k < 3; ++k) {
        border.push_back(place(t, k));
        add_between(t, k, border);
      }
      const auto inside = in_face_.find(places(triangles_[t]));
      if (border.size() == 3 && inside == in_face_.end()) continue;
      const std::optional<std::vector<glm::uvec3>> pieces =
          divide(t, border, inside == in_face_.end() ? Places() : inside->second);
      if (!pieces) {
        refuse(t);
        continue;
      }
      joined.triangles[t] = pieces->front();
      joined.is_piece[t] = true;
      for (std::size_t i = 1; i < pieces->size(); ++i) {
        joined.triangles.push_back((*pieces)[i]);
        joined.parent.push_back(t);
        joined.is_piece.push_back(true);
      }
    }
    return joined;
  }

  std::optional<std::vector<glm::uvec3>> divide(std::uint32_t t, const Places& border, const Places& inside) {
    const ThreePlaces corners{place(t, 0), place(t, 1), place(t, 2)};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) return std::nullopt;
    // Triangles at the same places are divided in the same way: their points have the same order.
    Places points(border);
    points.insert(points.end(), inside.begin(), inside.end());
    std::ranges::sort(points);
    if (std::ranges::adjacent_find(points) != points.end()) return std::nullopt;
    const auto number = [&](std::uint32_t p) {
      return static_cast<std::uint32_t>(std::ranges::lower_bound(points, p) - points.begin());
    };
    TriangleToDivide whole;
    double largest = 0;
    for (const std::uint32_t p : points) {
      whole.points.push_back(at(p));
      largest = std::max({largest, std::abs(at(p).x), std::abs(at(p).y), std::abs(at(p).z)});
    }
    for (int k = 0; k < 3; ++k) whole.corners[k] = number(corners[k]);
    for (const std::uint32_t p : border) whole.border.push_back(number(p));
    const double room = kTJunctionUnits * unit_ * largest;
    if (!add_edges(t, border, points, room, whole.edges)) return std::nullopt;
    std::optional<std::vector<glm::uvec3>> pieces = tolvol::divide(whole, kLeastHeight * room);
    if (!pieces) return std::nullopt;
    for (glm::uvec3& piece : *pieces) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t p = points[piece[k]];
        const auto own = std::ranges::find(corners, p);
        piece[k] = own == corners.end() ? vertex_at_[p] : triangles_[t][static_cast<int>(own - corners.begin())];
      }
    }
    return pieces;
  }

  /// Adds the edges of faces that lie on a triangle, by the numbers of their ends among `points`. Returns false if an
  /// edge runs on beyond the triangle between its corners.
  bool add_edges(std::uint32_t t, const Places& border, const Places& points, double room,
                 std::vector<std::pair<std::uint32_t, std::uint32_t>>& edges) {
    // A bit for each side that a point is on.
    std::map<std::uint32_t, int> sides;
    int side = -1;
    for (const std::uint32_t p : border) {
      const bool is_corner = side < 2 && p == place(t, side + 1);
      if (is_corner) ++side;
      sides[p] = is_corner ? 1 << side | 1 << (side + 2) % 3 : 1 << side;
    }
    bool all_end_here = true;
    for (const std::uint32_t p : points) {
      const auto around = neighbours_.find(p);
      if (around == neighbours_.end()) continue;
      const auto of_p = sides.find(p);
      const int sides_of_p = of_p == sides.end() ? 0 : of_p->second;
      for (const std::uint32_t q : around->second) {
        const auto found = std::ranges::lower_bound(points, q);
        if (found != points.end() && *found == q) {
          const auto of_q = sides.find(q);
          if (of_q != sides.end() && (of_q->second & sides_of_p)) continue;  // along the border
          const auto number = [&](std::uint32_t v) {
            return static_cast<std::uint32_t>(std::ranges::lower_bound(points, v) - points.begin());
          };
          edges.emplace_back(number(p), number(q));
        } else if (runs_along(t, p, sides_of_p, q, room)) {
          refused_places_.insert(p);
          all_end_here = false;
        }
      }
    }
    return all_end_here;
  }

  /// Whether the way from a point on a triangle to another point begins in the triangle's plane and leads into it.
  bool runs_along(std::uint32_t t, std::uint32_t p, int sides, std::uint32_t q, double room) const {
    const std::array<glm::dvec3, 3> corners{at(place(t, 0)), at(place(t, 1)), at(place(t, 2))};
    const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]), way = at(q) - at(p);
    const double area = glm::length(normal);
    double longest = 0;
    for (int k = 0; k < 3; ++k) longest = std::max(longest, glm::length(corners[(k + 1) % 3] - corners[k]));
    const double most = 2 * room * (1 + glm::length(way) * longest / area);
    if (!(std::abs(glm::dot(normal, way)) <= most * area)) return false;
    for (int k = 0; k < 3; ++k) {
      if (!(sides & 1 << k)) continue;
      const glm::dvec3 inwards = glm::cross(normal, corners[(k + 1) % 3] - corners[k]);
      if (glm::dot(inwards, way) <= most * glm::length(inwards)) return false;
    }
    return true;
  }

  /// Refuses triangles of which more pieces cross others than the triangles did.
  void refuse_crossings(const JoinedMesh& joined) {
    std::vector<Box> boxes;
    std::vector<std::uint32_t> all;
    const MeshView mesh{joined.triangles, vertices_};
    for (std::uint32_t t = 0; t < joined.triangles.size(); ++t)
      all.push_back(t), boxes.push_back(box_of(mesh.corners(t)));
    const FaceTree tree(all, boxes, team_);
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> crossings;
    for (std::uint32_t t = 0; t < joined.triangles.size(); ++t) {
      if (!joined.is_piece[t]) continue;
      tree.for_each_meeting(boxes[t], [&](std::uint32_t other) {
        poll();
        if (other == t || (joined.is_piece[other] && other < t)) return;
        if (!faces_cross(mesh.corners(t), mesh.corners(other))) return;
        ++crossings[std::minmax(joined.parent[t], joined.parent[other])];
      });
    }
    const MeshView before{triangles_, vertices_};
    for (const auto& [parents, count] : crossings) {
      const auto& [a, b] = parents;
      if (a != b) {
        if (places(triangles_[a]) == places(triangles_[b])) continue;  // of a double sheet
        if (count == 1 && faces_cross(before.corners(a), before.corners(b))) continue;
      }
      refuse(a), refuse(b);
    }
  }

  std::span<const glm::dvec3> vertices_;
  std::span<const glm::uvec3> triangles_;
  std::vector<TJunction> junctions_;
  double unit_;
  Team& team_;
  std::vector<std::uint32_t> place_;      // per vertex
  std::vector<std::uint32_t> vertex_at_;  // per place: the first vertex there that a triangle has
  std::unordered_map<std::uint64_t, Places> on_edge_;
  std::map<ThreePlaces, Places> in_face_;
  std::map<std::uint32_t, Places> neighbours_;  // of each place that is put in: the other ends of the edges there
  std::set<std::uint64_t> refused_edges_;
  std::set<ThreePlaces> refused_faces_;
  std::set<std::uint32_t> refused_places_;
};

}  // namespace

std::optional<JoinedMesh> join_t_junctions(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                                           std::span<const TJunction> junctions, double unit, Team& team) {
  if (junctions.empty()) return std::nullopt;
  return Joining(vertices, triangles, junctions, unit, team).run();
}

}  // namespace tolvol
