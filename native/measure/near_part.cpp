// SPDX-License-Identifier: GPL-3.0-or-later
// Let c be the middle of a box around a, r half its diagonal and y any vertex of b. No point of a is farther than
// r + |c - y| from b, so that the point of b nearest to it is within R = 2 r + |c - y| of c. A part of b that a plane
// keeps farther away than R is not needed.
//
// Rounding is covered as follows. All is decided in the frame of a. Placing a corner there errs by u times its size,
// and so do the dot products with unit vectors, which are compared with R. kSlack times the size of the corner is more
// than both. R is raised by 1e-6, which is more than its own rounding. A cut at any share between 0 and 1 is on the
// edge, so that the share needs no care.
#include "measure/near_part.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <map>
#include <utility>

#include "base/call.h"
#include "geometry/closest_point.h"
#include "geometry/lengths.h"

namespace tolvol {
namespace {

using glm::dvec3;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNear = 8;  // corners within this many R are near
constexpr double kCut = 32;  // far edges are cut this many R from their near corners
constexpr double kSlack = 64 * kUnitRoundoff;

dvec3 finite_direction(const dvec3& v) {
  const double size = norm(v);
  return size > 0 && size < kInfinite ? v / size : dvec3(0);
}

/// Returns the largest distance of a point of the box from the origin of the frame.
double extent(const Box& box, const Frame& frame) {
  return norm(glm::max(glm::abs(frame.from_world(box.lower)), glm::abs(frame.from_world(box.upper))));
}

class Cutter {
 public:
  Cutter(const TriangleMesh& b, const Frame& frame, double reach) : b_(b), frame_(frame), reach_(reach) {}

  void add(const glm::uvec3& t) {
    const std::array<dvec3, 3> p{at(t.x), at(t.y), at(t.z)};
    std::array<bool, 3> near{};
    int count = 0;
    for (int k = 0; k < 3; ++k) count += near[k] = norm(p[k]) <= kNear * reach_;
    if (count == 3) return keep(t);
    if (count == 0) {
      if (!beyond({p[0], p[1], p[2]})) keep(t);
      return;
    }
    // From here on a is the only near corner, or c is the only far corner.
    int first = 0;
    while (count == 1 ? !near[first] : near[(first + 2) % 3]) ++first;
    const std::uint32_t a = t[first], b = t[(first + 1) % 3], c = t[(first + 2) % 3];
    const End on_c = cut(a, c), other = count == 1 ? cut(a, b) : cut(b, c);
    if (on_c.share == 1 && other.share == 1) return keep(t);
    const dvec3 far_b = count == 1 ? at(b) : other.point;
    const bool all = !beyond({on_c.point, other.point, far_b, at(c)});
    // Also a triangle that stays is divided at the cuts, so that it still meets its neighbours along whole edges.
    const std::uint32_t v = vertex(other), w = vertex(on_c);
    if (count == 1) {
      keep({a, v, w});
      if (all && v != b) keep({v, b, c});
      if (all && w != c) keep({v, c, w});
    } else {
      // The diagonal leads to a cut, or else it would be an edge.
      keep(v == c ? glm::uvec3(a, b, w) : glm::uvec3(a, b, v));
      keep(v == c ? glm::uvec3(b, c, w) : glm::uvec3(a, v, w));
      if (all && v != c && w != c) keep({w, v, c});
    }
  }

  NearPart part() && {
    part_.whole = part_.triangles == b_.triangles;
    return std::move(part_);
  }

 private:
  /// The end of a triangle along one of its edges.
  struct End {
    std::uint32_t from, to;
    double share;  ///< is 1 at `to` itself
    dvec3 point;
  };

  dvec3 at(std::uint32_t vertex) const { return frame_.from_world(b_.vertices[vertex]); }

  void keep(const glm::uvec3& t) { part_.triangles.push_back(t); }

  End cut(std::uint32_t from, std::uint32_t to) const {
    const double length = norm(at(to) - at(from));
    if (length <= kCut * reach_) return {from, to, 1, at(to)};
    const NearPart::Cut cut{from, to, kCut * reach_ / length};
    return {from, to, cut.share, cut.in(frame_, b_)};
  }

  /// Returns the vertex of a cut, which neighbours share.
  std::uint32_t vertex(const End& end) {
    if (end.share == 1) return end.to;
    const auto next = std::uint32_t(b_.vertices.size() + part_.cuts.size());
    const auto [place, added] = cut_at_.try_emplace({end.from, end.to}, next);
    if (added) part_.cuts.push_back({end.from, end.to, end.share});
    return place->second;
  }

  /// Tells whether it is proved that the convex hull of the points is farther than `reach` from the origin.
  bool beyond(std::initializer_list<dvec3> points) const {
    const auto shown_by = [&](const dvec3& normal) {
      return std::all_of(points.begin(), points.end(),
                         [&](const dvec3& p) { return glm::dot(normal, p) > reach_ + kSlack * norm(p); });
    };
    const dvec3* const p = points.begin();
    const dvec3 edge = finite_direction(p[1] - p[0]);
    const dvec3 across = p[0] - glm::dot(p[0], edge) * edge;  // leads from the origin to the line of the cut
    if (shown_by(finite_direction(p[0])) || shown_by(finite_direction(across))) return true;
    for (int k = 0; k < 3; ++k) {
      dvec3 axis(0);
      axis[k] = 1;
      if (shown_by(axis) || shown_by(-axis)) return true;
    }
    return shown_by(finite_direction(closest_point(dvec3(0), p[0], p[1], p[2]).point));
  }

  const TriangleMesh& b_;
  const Frame& frame_;
  double reach_;
  NearPart part_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> cut_at_;
};

}  // namespace

Box box_of(const TriangleMesh& mesh) {
  Box box;
  std::size_t turn = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    poll_at(++turn);
    for (int k = 0; k < 3; ++k) box.add(mesh.vertices[t[k]]);
  }
  return box;
}

NearPart near_part(const TriangleMesh& a, const TriangleMesh& b) {
  const Box box_a = box_of(a), box_b = box_of(b);
  const Frame frame(box_a);
  const double radius = extent(box_a, frame), span = extent(box_b, frame);
  // Without a finite frame nothing can be proved.
  if (span <= kNear * radius || !(span < kInfinite) || !std::isfinite(frame.scale())) return {b.triangles, {}, true};
  double nearest = kInfinite;
  std::size_t turn = 0;
  for (const glm::uvec3& t : b.triangles) {
    poll_at(++turn);
    for (int k = 0; k < 3; ++k) nearest = std::min(nearest, norm(frame.from_world(b.vertices[t[k]])));
  }
  const double reach = (2 * radius + nearest) * (1 + 1e-6);
  if (!(reach > 0) || span <= kNear * reach) return {b.triangles, {}, true};
  Cutter cutter(b, frame, reach);
  for (const glm::uvec3& t : b.triangles) {
    poll_at(++turn);
    cutter.add(t);
  }
  return std::move(cutter).part();
}

}  // namespace tolvol
