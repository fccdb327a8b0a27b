// SPDX-License-Identifier: GPL-3.0-or-later
/// A bounding volume hierarchy over a triangle mesh, for exact nearest points.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "base/call.h"
#include "base/default_init.h"
#include "geometry/closest_point.h"
#include "geometry/oriented_boxes.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// A part of a triangle (geometry/hub_slices.h) between two lines, each of which is as far from one corner, the hub, on
/// both edges there. `from` and `to` are these distances over the longer one of the two edges. By default it is the
/// whole triangle.
struct HubSlice {
  float from = 0, to = std::numeric_limits<float>::infinity();
  std::uint32_t hub = 0;
};

/// A hierarchy is immutable once it is built, so that any number of threads may search it at the same time. Its results
/// are the same on every machine.
class Hierarchy {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  struct Nearest {
    std::uint32_t triangle = kNone;  ///< kNone: nothing within the radius
    glm::dvec3 point{0};
    glm::dvec3 weights{0};  ///< are barycentric in `triangle`
    double distance = std::numeric_limits<double>::infinity();
    std::uint32_t nodes = 0;  ///< counts the nodes that were visited, the same on every machine
  };

  struct Always {
    bool operator()(std::uint32_t) const { return true; }
  };
  struct Never {
    bool operator()(std::uint32_t) const { return false; }
  };

  struct Common {
    std::uint32_t triangle = kNone;  ///< kNone: nothing within the radius
    double distance = std::numeric_limits<double>::infinity();
    std::uint32_t nodes = 0;  ///< as in Nearest
  };

  /// Copies the triangles of a valid mesh (geometry/triangle_mesh.h), with about 150 bytes for each, or 330 if nearly
  /// all are needles, and up to seven times as much for those around a corner that very many share. O(m), 30 ms for
  /// 270,000 triangles on one thread; O(m log m) for needles. Degenerate triangles are kept as the segments or points
  /// that they are. `threads`: 0 means one for each core.
  explicit Hierarchy(const TriangleMesh& mesh, unsigned threads = 1);

  /// Returns the nearest point of the mesh within `radius` (inclusive). Ties go to the lower triangle index, so that
  /// the result does not depend on the shape of the tree. `hint` is a triangle that is tried first, to shorten the
  /// search, or kNone. A search takes about 1 us for a point near the surface of a scan, and half of that with a good
  /// hint. The coordinates of p must be finite.
  Nearest nearest(const glm::dvec3& p, double radius = std::numeric_limits<double>::infinity(),
                  std::uint32_t hint = kNone) const {
    return nearest_if(
        p, [](std::uint32_t) { return true; }, radius, hint);
  }

  /// The same among the triangles for which accept(index) holds. `may_accept(node)` is false only where accept() holds
  /// for no triangle below the node; without it, a search whose radius holds many triangles, of which none is accepted,
  /// looks at all of them. The search ends early at a triangle that is nearer than all before it if enough(index)
  /// holds.
  template <class Accept, class MayAccept = Always, class Enough = Never>
  Nearest nearest_if(const glm::dvec3& p, Accept&& accept, double radius = std::numeric_limits<double>::infinity(),
                     std::uint32_t hint = kNone, MayAccept&& may_accept = {}, Enough&& enough = {}) const;

  /// Tells what is directly below a node: calls triangle(index) for triangles, which are below more than one node if
  /// they are cut into slices, and child(node below) for nodes, whose numbers are higher than the node's.
  template <class OfTriangle, class OfNode>
  void for_each_child(std::uint32_t node, OfTriangle&& triangle, OfNode&& child) const;
  std::uint32_t node_count() const { return static_cast<std::uint32_t>(nodes_.size()); }

  /// Returns the triangle whose distance from the farthest of `points` (1 to 4 of them) is least, if this distance is
  /// within `radius`. Ties go to the lower index. By convexity the distance holds for the whole convex hull of the
  /// points. The search ends early at any triangle that is within `enough` of all points. If a point is farther from
  /// the mesh than 2^27 times its size, the triangle may be worse than the best by 2^-26 of the distance; `distance` is
  /// true for the triangle that is returned. A triangle at a corner that 64 or more share may be missed if its points
  /// nearest to the given ones are at very different distances from this corner, unless it is `hint`.
  Common common(std::span<const glm::dvec3> points, double radius = std::numeric_limits<double>::infinity(),
                double enough = -1, std::uint32_t hint = kNone) const;

  /// Calls visit(index) once for every triangle that is within `radius` (inclusive) of p, and for some others whose box
  /// is. A visit that returns false is the last one; it may also return nothing. Triangles that are only below nodes
  /// for which may_visit(node) does not hold may be left out. Returns the number of visited nodes.
  template <class Visit, class MayVisit = Always>
  std::size_t for_each_within(const glm::dvec3& p, double radius, Visit&& visit, MayVisit&& may_visit = {}) const;

  std::size_t size() const { return place_.size(); }
  /// Tells whether most nodes hold needles, which overlap where they are side by side: many are then nearly as near to
  /// a point as the nearest one.
  bool has_mostly_needles() const { return 2 * oriented_.size() > nodes_.size(); }

 private:
  static constexpr int kWidth = OrientedBoxes::kWidth;
  static constexpr std::uint32_t kTriangle = 0x80000000u;  // This bit marks a child as a place in the sorted order.
  // Points farther out than kFloatReach half sizes are compared in double. Points farther out than kReach half sizes
  // are moved towards the centre (hierarchy.cpp).
  static constexpr double kFloatReach = 64, kReach = 134217728;

  struct alignas(32) Node {
    float lower[3][kWidth], upper[3][kWidth];  // are local and rounded outwards; an empty child lies infinitely far
    std::uint32_t child[kWidth];
  };
  /// Tells of a node below which there are only slices of triangles with one hub.
  struct AroundHub {
    glm::dvec3 hub;                   // is scaled
    float lower[3], upper[3];         // hold all that leads from the hub to another corner
    std::uint32_t first = kTriangle;  // is the place of a slice of the triangle with the lowest index
  };
  struct Build;
  glm::dvec3 scaled(const glm::dvec3& p) const { return p * scale_; }
  /// Returns the local point from which the triangle nearest to p (in the mesh's units) is searched.
  glm::dvec3 local(const glm::dvec3& p, bool& beyond_reach) const;
  static Nearest unscaled(std::uint32_t triangle, const ClosestPoint& q, double scale) {
    return {triangle, q.point * (1 / scale), q.weights, std::sqrt(q.distance_squared) * (1 / scale)};
  }
  /// Returns the point of a triangle nearest to p, however far away p is.
  Nearest seen_from(const glm::dvec3& p, std::uint32_t triangle) const;
  /// Tells whether the point of the triangle that is nearest to q, in scaled coordinates, is in the slice of this
  /// place.
  bool is_nearest_slice(const glm::dvec3& q, std::uint32_t place) const;
  /// Returns what is known of a node if the common hub of all triangles below it is surely the point of each of them
  /// that is nearest to q, in scaled coordinates, or null.
  const AroundHub* nearest_at_hub(std::uint32_t node, const glm::dvec3& q) const;
  /// Returns the next triangle with exactly the same corners, or kNone after the last one.
  std::uint32_t twin(std::uint32_t triangle) const { return twin_.empty() ? kNone : twin_[triangle]; }

  /// Calls attempt(place) for the triangles whose box is within the bound, which `attempt` lowers when it finds a
  /// better triangle. `bound` is the square of a scaled distance, and points are local. A triangle that is cut into
  /// slices has a place for each. Nodes for which enter(node) does not hold are left out. Returns the number of visited
  /// nodes.
  template <int Count, class Attempt, class Enter = Always>
  std::size_t walk(const std::array<glm::dvec3, Count>& points, double& bound, Attempt&& attempt,
                   Enter&& enter = {}) const;
  template <class Real, int Count, class Attempt, class Enter>
  std::size_t walk_in(const std::array<glm::dvec3, Count>& points, double& bound, Attempt&& attempt,
                      Enter&& enter) const;
  const OrientedBoxes* oriented_boxes(std::uint32_t node) const {
    return turned_.empty() || turned_[node] == kNone ? nullptr : &oriented_[turned_[node]];
  }
  /// Computes the squared distances of the eight boxes of a node from the box `from`, `to`. This is a function of its
  /// own because the compiler does not vectorise it within walk_in.
  template <class Real>
  static void box_distances(const Node& node, const Real (&from)[3], const Real (&to)[3], Real (&squared)[kWidth]);
  template <int Count>
  Common common_of(std::span<const glm::dvec3> points, double radius, double enough, std::uint32_t hint) const;

  Unfilled<Node> nodes_;                 // nodes_[0] is the root
  std::vector<std::uint32_t> turned_;    // maps a node to its oriented boxes or kNone; it is empty if no node has any
  std::vector<OrientedBoxes> oriented_;  // replace the boxes of some nodes
  std::vector<std::uint32_t> around_;    // maps a node to its place in hubs_ or kNone; it is empty if there are no hubs
  std::vector<AroundHub> hubs_;          // of the nodes around hubs
  Unfilled<Corners> corners_;            // are scaled, in the sorted order, with only the first of equal triangles
  std::vector<HubSlice> slices_;         // of all triangles that are cut into slices
  Unfilled<std::uint32_t> slice_;        // maps a place in the sorted order to an index in slices_, or to kNone for a
                                         // whole triangle; empty if there are no slices
  Unfilled<std::uint32_t> triangle_;     // maps a place in the sorted order to an index in the mesh
  Unfilled<std::uint32_t> place_;        // maps an index in the mesh to a place in the sorted order, of any slice
  std::vector<std::uint32_t> twin_;      // is used by twin(), and empty if no two triangles are equal
  glm::dvec3 centre_{0};                 // is scaled
  double scale_ = 1;                     // is a power of two that makes half the size of the mesh 1/2 to 1
};

template <class Accept, class MayAccept, class Enough>
Hierarchy::Nearest Hierarchy::nearest_if(const glm::dvec3& p, Accept&& accept, double radius, std::uint32_t hint,
                                         MayAccept&& may_accept, Enough&& enough) const {
  bool beyond_reach = false;
  const glm::dvec3 at = local(p, beyond_reach), q = beyond_reach ? at + centre_ : scaled(p);
  std::uint32_t best = kNone;
  ClosestPoint closest{glm::dvec3(0), glm::dvec3(0), std::numeric_limits<double>::infinity()};
  const double reach = beyond_reach ? closest.distance_squared : radius * scale_;
  // The bound is a little larger than the radius. The end of the search compares the distance with the radius itself.
  double bound = reach * reach * (1 + 1e-12);
  // Most searches look at fewer triangles than this, and would gain nothing by comparing with their planes.
  constexpr unsigned kFew = 16;
  unsigned tried = 0;
  auto attempt = [&](std::uint32_t place) {
    std::uint32_t triangle = triangle_[place];
    while (triangle != kNone && !accept(triangle)) triangle = twin(triangle);
    if (triangle == kNone) return;
    const Corners& t = corners_[place];
    if (++tried > kFew && is_beyond(q, t[0], t[1], t[2], closest.distance_squared)) return;
    const ClosestPoint candidate = closest_point(q, t[0], t[1], t[2]);
    if (candidate.distance_squared > closest.distance_squared) return;
    // A tie goes to the lower index; kNone is above all indices.
    if (candidate.distance_squared == closest.distance_squared && triangle > best) return;
    best = triangle;
    closest = candidate;
    bound = enough(triangle) ? -1 : std::min(bound, closest.distance_squared);
  };
  // Where a hub is nearest, it is the nearest point of all triangles around it. Of those below a node, only the one
  // that would win the tie is looked at, if it is accepted.
  const auto enter = [&](std::uint32_t node) {
    if (!may_accept(node)) return false;
    const AroundHub* const around = nearest_at_hub(node, q);
    if (!around) return true;
    const glm::dvec3 way = q - around->hub;
    const double there = glm::dot(way, way);
    const auto may_win = [&] {
      return there < closest.distance_squared || (there == closest.distance_squared && triangle_[around->first] < best);
    };
    if (may_win()) attempt(around->first);
    return may_win();
  };
  if (hint < place_.size()) attempt(place_[hint]);
  const auto nodes = nodes_.empty() ? 0 : std::uint32_t(walk<1>({at}, bound, attempt, enter));
  Nearest found;
  if (best != kNone) found = beyond_reach ? seen_from(p, best) : unscaled(best, closest, scale_);
  if (!(found.distance <= radius)) found = Nearest{};
  found.nodes = nodes;
  return found;
}

template <class Visit, class MayVisit>
std::size_t Hierarchy::for_each_within(const glm::dvec3& p, double radius, Visit&& visit, MayVisit&& may_visit) const {
  const auto goes_on = [&](std::uint32_t triangle) {
    if constexpr (std::is_same_v<decltype(visit(triangle)), bool>) {
      return visit(triangle);
    } else {
      visit(triangle);
      return true;
    }
  };
  bool beyond_reach = false;
  const glm::dvec3 at = local(p, beyond_reach);
  if (beyond_reach) {
    for (std::uint32_t triangle = 0; triangle < place_.size() && goes_on(triangle);) ++triangle;
    return nodes_.size();
  }
  if (!nodes_.empty()) {
    double bound = radius * scale_ * (radius * scale_) * (1 + 1e-12);
    bool more = true;
    const glm::dvec3 q = scaled(p);
    const auto attempt = [&](std::uint32_t place) {
      if (!slice_.empty() && !is_nearest_slice(q, place)) return;
      for (std::uint32_t triangle = triangle_[place]; more && triangle != kNone; triangle = twin(triangle)) {
        more = goes_on(triangle);
      }
      if (!more) bound = -1;  // this ends the search
    };
    return walk<1>({at}, bound, attempt, may_visit);
  }
  return 0;
}

template <class OfTriangle, class OfNode>
void Hierarchy::for_each_child(std::uint32_t node, OfTriangle&& triangle, OfNode&& child) const {
  const Node& above = nodes_[node];
  for (int c = 0; c < kWidth; ++c) {
    if (above.lower[0][c] > above.upper[0][c]) continue;  // there is no such child
    const std::uint32_t below = above.child[c];
    if (!(below & kTriangle)) {
      child(below);
      continue;
    }
    for (std::uint32_t i = triangle_[below & ~kTriangle]; i != kNone; i = twin(i)) triangle(i);
  }
}

template <int Count, class Attempt, class Enter>
std::size_t Hierarchy::walk(const std::array<glm::dvec3, Count>& points, double& bound, Attempt&& attempt,
                            Enter&& enter) const {
  double farthest = 0;
  for (const glm::dvec3& p : points) {
    for (int k = 0; k < 3; ++k) farthest = std::max(farthest, std::abs(p[k]));
  }
  if (farthest <= kFloatReach) {
    return walk_in<float, Count>(points, bound, attempt, enter);
  }
  return walk_in<double, Count>(points, bound, attempt, enter);
}

template <class Real, int Count, class Attempt, class Enter>
std::size_t Hierarchy::walk_in(const std::array<glm::dvec3, Count>& points, double& bound, Attempt&& attempt,
                               Enter&& enter) const {
  // hierarchy.cpp derives the margins.
  constexpr bool kSingle = sizeof(Real) == sizeof(float);
  constexpr double kMargin = kSingle ? 1 + 1e-6 : 1 + 1e-13;
  constexpr Real kSpread = kSingle ? Real(2.4e-7) : Real(0), kTiny = kSingle ? Real(1e-37) : Real(0);
  Real from[Count][3], to[Count][3];
  for (int i = 0; i < Count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Real x = Real(points[i][k]), spread = (x < 0 ? -x : x) * kSpread + kTiny;
      from[i][k] = x - spread;
      to[i][k] = x + spread;
    }
  }
  auto threshold = [&] {
    return bound * kMargin < double(std::numeric_limits<Real>::max()) ? Real(bound * kMargin) + kTiny
                                                                      : std::numeric_limits<Real>::max();
  };
  struct Entry {
    Real squared;
    std::uint32_t child;
  };
  // A binary split ends after 63 bits of the code and 32 halvings. Each of the at most 95 levels leaves 7 siblings.
  std::array<Entry, 7 * 96 + kWidth> stack;
  int height = 0;
  stack[height++] = {Real(0), 0};
  constexpr unsigned kBetweenPolls = 1024;  // A search polls after this many nodes. Nearly all searches visit fewer.
  std::size_t visited = 0;
  while (height > 0) {
    if (++visited % kBetweenPolls == 0) poll();
    const Entry top = stack[--height];
    Real limit = threshold();
    if (top.squared > limit || !enter(top.child)) continue;
    const Node& node = nodes_[top.child];
    const OrientedBoxes* oriented = oriented_boxes(top.child);
    Real squared[kWidth];
    for (int i = 0; i < Count; ++i) {
      Real other[kWidth];
      if (oriented) {
        oriented->distances(points[i], other);
      } else {
        box_distances(node, from[i], to[i], other);
      }
      for (int c = 0; c < kWidth; ++c) squared[c] = i == 0 || other[c] > squared[c] ? other[c] : squared[c];
    }
    Entry near[kWidth];
    int count = 0;
    unsigned within = 0;
    for (int c = 0; c < kWidth; ++c) within |= unsigned(squared[c] <= limit) << c;
    for (; within != 0; within &= within - 1) {
      const int c = std::countr_zero(within);
      int i = count++;
      for (; i > 0 && near[i - 1].squared > squared[c]; --i) near[i] = near[i - 1];
      near[i] = {squared[c], node.child[c]};
    }
    for (int i = 0; i < count; ++i) {
      if (!(near[i].child & kTriangle) || near[i].squared > limit) continue;
      attempt(near[i].child & ~kTriangle);
      limit = threshold();
    }
    for (int i = count; i-- > 0;) {
      if (!(near[i].child & kTriangle) && near[i].squared <= limit) stack[height++] = near[i];
    }
  }
  return visited;
}

}  // namespace tolvol
