// SPDX-License-Identifier: GPL-3.0-or-later
// Around a vertex, as seen from the front, fans of triangles and gaps take turns. A fan reaches counter-clockwise from
// an open edge that leaves the vertex to one that arrives, and a gap from one that arrives to one that leaves. So the
// loop that arrives goes on with the first edge that leaves, counter-clockwise. Where the surface around the vertex is
// so crooked that the edges do not take turns, they are matched like brackets.
#include "topology/boundary_loops.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <unordered_set>
#include <utility>

#include "base/call.h"
#include "topology/sides.h"
#include "topology/sort_by.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNoSide = 0xFFFFFFFFu;

/// The places of a triangle's corners, turned so that the lowest comes first.
struct CornerPlaces {
  glm::uvec3 at;
  bool operator==(const CornerPlaces& other) const { return at == other.at; }
};
struct HashOfCornerPlaces {
  std::size_t operator()(const CornerPlaces& p) const {
    std::uint64_t hash = 0;
    for (int k = 0; k < 3; ++k) hash = (hash ^ p.at[k]) * 0x9E3779B97F4A7C15u, hash ^= hash >> 29;
    return hash;
  }
};

/// An edge at a vertex where several holes meet.
struct End {
  double turn;  ///< rises with the angle around the vertex, from 0 to 4
  bool leaves;
  Side side;
  bool operator<(const End& other) const {
    if (turn != other.turn) return turn < other.turn;
    return std::pair(leaves, side) < std::pair(other.leaves, other.side);
  }
};

class Loops {
 public:
  Loops(std::span<const glm::dvec3> positions, std::span<const std::uint32_t> place,
        std::span<const glm::uvec3> triangles, Team& team)
      : positions_(positions), place_(place), triangles_(triangles) {
    find_open(team);
    link(team);
  }

  std::vector<BoundaryLoop> walk() const {
    std::vector<std::pair<Side, BoundaryLoop>> found;  // each with its lowest side
    std::vector<bool> has_one_before(3 * triangles_.size(), false), walked(3 * triangles_.size(), false);
    for (const Side side : open_) {
      if (next_[side] != kNoSide) has_one_before[next_[side]] = true;
    }
    const auto follow = [&](Side first) {
      BoundaryLoop loop{{}, false};
      Side side = first, lowest = first;
      for (; side != kNoSide && !walked[side]; side = next_[side]) {
        poll_at(loop.sides.size());
        walked[side] = true;
        lowest = std::min(lowest, side);
        loop.sides.push_back(side);
      }
      loop.closed = side == first;
      found.emplace_back(lowest, std::move(loop));
    };
    // Runs that do not close begin at an edge that nothing leads to.
    for (const Side side : open_) {
      if (!has_one_before[side]) follow(side);
    }
    for (const Side side : open_) {
      if (!walked[side]) follow(side);
    }
    std::ranges::sort(found, {}, &std::pair<Side, BoundaryLoop>::first);
    std::vector<BoundaryLoop> loops;
    loops.reserve(found.size());
    for (auto& [lowest, loop] : found) loops.push_back(std::move(loop));
    return loops;
  }

 private:
  std::uint32_t at(Side corner) const { return place_[triangles_[corner / 3][static_cast<int>(corner % 3)]]; }

  void find_open(Team& team) {
    std::vector<Side> sides;
    sides.reserve(3 * triangles_.size());
    std::unordered_set<CornerPlaces, HashOfCornerPlaces> seen;
    seen.reserve(triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      poll_at(t);
      glm::uvec3 p(at(3 * t), at(3 * t + 1), at(3 * t + 2));
      if (p.x == p.y || p.y == p.z || p.z == p.x) continue;
      while (p.x > p.y || p.x > p.z) p = {p.y, p.z, p.x};
      if (!seen.insert({p}).second) continue;
      for (Side k = 0; k < 3; ++k) sides.push_back(3 * t + k);
    }
    std::vector<bool> is_open(3 * triangles_.size(), false);
    by_ends(
        sides, positions_.size(), team, [this](Side corner) { return at(corner); },
        [&](const std::vector<Side>& alike) {
          if (alike.size() == 1) is_open[alike.front()] = true;
        });
    for (Side side = 0; side < is_open.size(); ++side) {
      poll_at(side);
      if (is_open[side]) open_.push_back(side);
    }
  }

  /// A function that returns for a point a number that rises with the angle around `centre` and `normal`.
  static auto turns_around(const glm::dvec3& centre, const glm::dvec3& normal) {
    const double length = glm::length(normal);
    const glm::dvec3 n = length > 0 ? normal * (1 / length) : glm::dvec3(0);
    glm::dvec3 axis(0);
    axis[std::abs(n.x) <= std::abs(n.y) ? (std::abs(n.x) <= std::abs(n.z) ? 0 : 2)
                                        : (std::abs(n.y) <= std::abs(n.z) ? 1 : 2)] = 1;
    glm::dvec3 u = glm::cross(n, axis);
    if (length > 0) u *= 1 / glm::length(u);
    return [centre, u, v = glm::cross(n, u)](const glm::dvec3& p) {
      const double x = glm::dot(p - centre, u), y = glm::dot(p - centre, v), sum = std::abs(x) + std::abs(y);
      if (!(sum > 0)) return 0.0;
      return y >= 0 ? 1 - x / sum : 3 + x / sum;
    };
  }

  /// Finds the open edge that follows on each.
  void link(Team& team) {
    next_.assign(3 * triangles_.size(), kNoSide);
    using Keyed = std::pair<std::uint32_t, Side>;
    std::vector<Keyed> leaving, arriving;
    for (const Side side : open_)
      leaving.emplace_back(at(side), side), arriving.emplace_back(at(next_corner(side)), side);
    const auto vertex = [](const Keyed& keyed) { return keyed.first; };
    sort_by(leaving, positions_.size(), team, vertex, std::less<Keyed>());
    sort_by(arriving, positions_.size(), team, vertex, std::less<Keyed>());
    std::vector<bool> is_crowded(positions_.size(), false);
    std::vector<std::pair<std::size_t, std::size_t>> crowds;  // the first of each in `leaving` and in `arriving`
    for (std::size_t i = 0, k = 0; i < leaving.size(); ++i) {
      const std::uint32_t here = leaving[i].first;
      const std::size_t first = i;
      while (i + 1 < leaving.size() && leaving[i + 1].first == here) ++i;
      while (k < arriving.size() && arriving[k].first < here) ++k;
      if (k == arriving.size() || arriving[k].first != here) continue;
      if (first == i && (k + 1 == arriving.size() || arriving[k + 1].first != here)) {
        next_[arriving[k].second] = leaving[i].second;
        continue;
      }
      is_crowded[here] = true;
      crowds.emplace_back(first, k);
    }
    if (crowds.empty()) return;
    std::vector<glm::dvec3> normals(positions_.size(), glm::dvec3(0));
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      poll_at(t);
      for (Side corner = 3 * t; corner < 3 * t + 3; ++corner) {
        if (!is_crowded[at(corner)]) continue;
        const glm::uvec3& c = triangles_[t];
        normals[at(corner)] += glm::cross(positions_[c.y] - positions_[c.x], positions_[c.z] - positions_[c.x]);
      }
    }
    std::vector<End> ends;
    for (auto [i, k] : crowds) {
      const std::uint32_t here = leaving[i].first;
      const auto turn = turns_around(positions_[here], normals[here]);
      ends.clear();
      for (; i < leaving.size() && leaving[i].first == here; ++i) {
        const Side side = leaving[i].second;
        ends.push_back({turn(positions_[at(next_corner(side))]), true, side});
      }
      for (; k < arriving.size() && arriving[k].first == here; ++k) {
        const Side side = arriving[k].second;
        ends.push_back({turn(positions_[at(side)]), false, side});
      }
      std::sort(ends.begin(), ends.end());
      match(ends);
    }
  }

  /// Matches each edge that arrives with one that leaves. `ends` are in their order around the vertex.
  void match(const std::vector<End>& ends) {
    std::vector<Side> waiting;
    std::vector<bool> taken(ends.size(), false);
    for (std::size_t turn = 0; turn < 2 * ends.size(); ++turn) {
      const std::size_t i = turn % ends.size();
      if (taken[i]) continue;
      if (ends[i].leaves) {
        if (waiting.empty()) continue;
        next_[waiting.back()] = ends[i].side;
        waiting.pop_back();
        taken[i] = true;
      } else if (turn < ends.size()) {
        waiting.push_back(ends[i].side);
      }
    }
  }

  std::span<const glm::dvec3> positions_;
  std::span<const std::uint32_t> place_;
  std::span<const glm::uvec3> triangles_;
  std::vector<Side> open_;           ///< in rising order
  std::vector<std::uint32_t> next_;  ///< for each open side, the one that follows it, or kNoSide
};

}  // namespace

std::vector<BoundaryLoop> boundary_loops(std::span<const glm::dvec3> positions, std::span<const std::uint32_t> place,
                                         std::span<const glm::uvec3> triangles, Team& team) {
  return Loops(positions, place, triangles, team).walk();
}

}  // namespace tolvol
