// SPDX-License-Identifier: GPL-3.0-or-later
// This is the "local" method of Guéziec et al.: mark the edges to cut, then let each fan of corners that stay connected
// through uncut edges form a vertex. It deviates in three ways. Edges are matched in two passes, by index and then by
// position. Orientation is made consistent on the way. Triangles are cut off whole in the rare case that two distinct
// edges would end in the same two vertices.
#include "topology/manifold_cut.h"

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "base/call.h"
#include "base/default_init.h"
#include "geometry/triangle_mesh.h"
#include "geometry/weld.h"
#include "topology/sides.h"
#include "topology/sort_by.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNone = CutMesh::kNone;
/// The cosine of the angle within which triangles at a common edge count as lying upon each other.
constexpr double kUpon = 0.9;

class Cutter {
 public:
  Cutter(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, Team& team)
      : team_(team), positions_(vertices), input_(triangles), weld_(weld_equal_positions(vertices, team)) {
    cut_.stand_in.resize(triangles.size());
    std::iota(cut_.stand_in.begin(), cut_.stand_in.end(), 0u);
    const std::vector<bool> used = used_vertices(vertices.size(), triangles);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (!used[i] || weld_[i] == i) continue;
      renamed_ = true;
      cut_.welded += used[weld_[i]];
    }
  }

  CutMesh run() {
    sort_out_triangles();
    mate_.assign(3 * triangles_.size(), kNone);
    is_cut_.assign(3 * triangles_.size(), false);
    join_sides();
    orient();
    while (!form_vertices()) {
    }
    write();
    return std::move(cut_);
  }

 private:
  /// Return the weld representative of a corner's vertex, and the vertex itself. Corners are in the input's order.
  std::uint32_t welded(Side corner) const { return weld_[vertex(corner)]; }
  std::uint32_t vertex(Side corner) const { return input_[triangles_[corner / 3]][corner % 3]; }

  struct Keyed {
    std::array<std::uint32_t, 3> key;
    std::uint32_t triangle;
  };
  /// Lowers first[t] to the first triangle that has the same key as t.
  void find_first(Unfilled<Keyed>& triangles, std::vector<std::uint32_t>& first) const {
    sort_by(
        triangles, weld_.size(), team_, [](const Keyed& t) { return t.key[0]; },
        [](const Keyed& a, const Keyed& b) { return std::tie(a.key, a.triangle) < std::tie(b.key, b.triangle); });
    std::uint32_t of_key = 0;
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      if (i == 0 || triangles[i].key != triangles[i - 1].key) of_key = triangles[i].triangle;
      std::uint32_t& lowest = first[triangles[i].triangle];
      lowest = std::min(lowest, of_key);
    }
  }

  void sort_out_triangles() {
    Unfilled<Keyed> turned, same;
    same.reserve(input_.size());
    std::vector<std::uint32_t> degenerate;
    for (std::uint32_t i = 0; i < input_.size(); ++i) {
      poll_at(i);
      std::array<std::uint32_t, 3> t{weld_[input_[i].x], weld_[input_[i].y], weld_[input_[i].z]};
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
        degenerate.push_back(i);
        continue;
      }
      if (renamed_) {  // otherwise this would find only the same three vertices
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
        turned.push_back({t, i});
      }
      t = {input_[i].x, input_[i].y, input_[i].z};
      std::sort(t.begin(), t.end());
      same.push_back({t, i});
    }
    // Two triangles are equal if their positions turn the same way, or if they have the same three vertices. Blender,
    // too, holds only one such face. The two sides of a sheet stay two if each has vertices of its own.
    std::vector<std::uint32_t> first(input_.size(), kNone);
    find_first(turned, first);
    find_first(same, first);
    for (std::uint32_t i = 0; i < input_.size(); ++i) {
      if (first[i] == i) {
        triangles_.push_back(i);
      } else if (first[i] != kNone) {
        cut_.stand_in[i] = cut_.stand_in[first[i]];
        ++cut_.duplicates;
      }
    }
    if (!degenerate.empty()) sort_out_degenerate(degenerate);
  }

  void sort_out_degenerate(const std::vector<std::uint32_t>& degenerate) {
    std::unordered_map<std::uint64_t, std::uint32_t> holder;  // maps an edge, or a point as (p, p), to a triangle
    for (const std::uint32_t i : triangles_) {
      poll_at(i);
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = weld_[input_[i][k]], b = weld_[input_[i][(k + 1) % 3]];
        holder.try_emplace(pair_key(a, b), i);
        holder.try_emplace(pair_key(a, a), i);
      }
    }
    for (const std::uint32_t i : degenerate) {
      const std::uint32_t a = weld_[input_[i].x], b = weld_[input_[i].y], c = weld_[input_[i].z];
      const auto found = holder.find(pair_key(a, a == b ? c : b));
      if (found != holder.end()) {
        cut_.stand_in[i] = found->second;
        ++cut_.degenerate_on_edge;
      } else {
        cut_.aside.push_back(i);
      }
    }
  }

  void join_sides() {
    for (const bool by_position : {false, true}) {
      if (by_position && !renamed_) return;  // positions would give the same sides as indices
      std::vector<Side> open;
      open.reserve(mate_.size());
      for (Side s = 0; s < mate_.size(); ++s) {
        if (mate_[s] == kNone && !is_cut_[s]) open.push_back(s);
      }
      const auto end_of = [&](Side corner) { return by_position ? welded(corner) : vertex(corner); };
      by_ends(open, weld_.size(), team_, end_of, [&](const std::vector<Side>& alike) {
        if (alike.size() == 2) {
          mate_[alike[0]] = alike[1], mate_[alike[1]] = alike[0];
          oriented_ = oriented_ && opposed(alike[0], alike[1]);
        } else if (alike.size() > 2) {
          for (const Side s : alike) is_cut_[s] = true;
          ++cut_.cut_edges;
        }
      });
    }
  }

  /// Tells whether two sides run against each other, as those of neighbours should.
  bool opposed(Side s, Side other) const { return welded(s) == welded(next_corner(other)); }

  void cut_side(Side s) {
    const Side other = mate_[s];
    if (other == kNone) return;
    mate_[s] = mate_[other] = kNone;
    is_cut_[s] = is_cut_[other] = true;
    ++cut_.cut_edges;
  }

  void orient() {
    flip_.assign(triangles_.size(), false);
    if (oriented_) return;
    std::vector<bool> seen(triangles_.size(), false);
    std::vector<std::uint32_t> queue;
    for (std::uint32_t seed = 0; seed < triangles_.size(); ++seed) {
      poll_at(seed);
      if (seen[seed]) continue;
      seen[seed] = true;
      queue.assign(1, seed);
      std::size_t flipped = 0;
      for (std::size_t at = 0; at < queue.size(); ++at) {
        poll_at(at + 1);
        const std::uint32_t t = queue[at];
        for (Side s = 3 * t; s < 3 * t + 3; ++s) {
          const Side other = mate_[s];
          if (other == kNone) continue;
          const bool flip = flip_[t] != !opposed(s, other);
          if (!seen[other / 3]) {
            seen[other / 3] = true;
            flip_[other / 3] = flip;
            flipped += flip;
            queue.push_back(other / 3);
          } else if (flip_[other / 3] != flip) {
            cut_side(s);  // the surface is one-sided, like a Möbius strip
          }
        }
      }
      cut_.reversed_count += std::min(flipped, queue.size() - flipped);
    }
  }

  /// Forms the vertices of corners that are connected through uncut edges. Returns false if two different edges ended
  /// in the same two vertices: their triangles were cut off, and the vertices must be formed anew.
  bool form_vertices() {
    corner_vertex_.assign(mate_.size(), kNone);
    std::uint32_t count = 0;
    for (Side s = 0; s < mate_.size(); ++s) {
      poll_at(s);
      if (corner_vertex_[s] != kNone) continue;
      corner_vertex_[s] = count;
      for (const bool forth : {true, false}) walk(s, forth, count);
      ++count;
    }
    // Vertices that did not change have only edges that join_sides() saw.
    if (!renamed_ && cut_.cut_edges == 0) return true;

    std::vector<Side> all(mate_.size());
    std::iota(all.begin(), all.end(), 0u);
    std::vector<std::uint32_t> offenders;
    const auto end_of = [&](Side corner) { return corner_vertex_[corner]; };
    by_ends(all, count, team_, end_of, [&](const std::vector<Side>& alike) {
      if (alike.size() > 2 || (alike.size() == 2 && mate_[alike[0]] != alike[1])) {
        for (const Side s : alike) offenders.push_back(s / 3);
      }
    });
    for (const std::uint32_t t : offenders) {
      for (Side s = 3 * t; s < 3 * t + 3; ++s) {
        cut_side(s);
        is_cut_[s] = true;
      }
    }
    return offenders.empty();
  }

  /// Walks from triangle to triangle around a vertex. It leaves each triangle through the side that begins at its
  /// corner if `forth`, or else through the side that ends there.
  void walk(Side corner, bool forth, std::uint32_t name) {
    for (;;) {
      const Side through = forth ? corner : previous_corner(corner), other = mate_[through];
      if (other == kNone) return;
      if (flip_[through / 3] != flip_[other / 3]) forth = !forth;
      corner = forth ? next_corner(other) : other;
      if (corner_vertex_[corner] != kNone) return;
      corner_vertex_[corner] = name;
    }
  }

  void write() {
    cut_.input_vertex.assign(weld_.size(), kNone);
    std::vector<bool> several(weld_.size(), false);  // tells which input vertices became several
    for (Side s = 0; s < mate_.size(); ++s) {
      poll_at(s);
      const std::uint32_t v = corner_vertex_[s];
      if (v == cut_.vertex_input.size()) cut_.vertex_input.push_back(vertex(s));
      cut_.vertex_input[v] = std::min(cut_.vertex_input[v], vertex(s));
      std::uint32_t& of_input = cut_.input_vertex[vertex(s)];
      if (of_input != kNone && of_input != v) several[vertex(s)] = true;
      if (of_input == kNone) of_input = v;
    }
    cut_.cause.assign(cut_.vertex_input.size(), CutCause::none);
    std::unordered_set<std::uint32_t> tied;  // has the weld representatives of degenerate triangles set aside
    for (const std::uint32_t i : cut_.aside) {
      for (int k = 0; k < 3; ++k) tied.insert(weld_[input_[i][k]]);
    }
    for (Side s = 0; s < mate_.size(); ++s) {
      poll_at(s);
      const std::uint32_t v = corner_vertex_[s];
      if (several[vertex(s)]) cut_.cause[v] = CutCause::non_manifold;
      if (is_cut_[s]) {
        cut_.cause[v] = CutCause::non_manifold;
        cut_.cause[corner_vertex_[next_corner(s)]] = CutCause::non_manifold;
      }
    }
    for (Side s = 0; s < mate_.size() && !tied.empty(); ++s) {
      if (tied.contains(welded(s))) cut_.cause[corner_vertex_[s]] = CutCause::degenerate;
    }
    // The last side of a triangle is the first if it is turned over.
    const auto turned = [&](Side s) { return flip_[s / 3] ? s - s % 3 + 2 - s % 3 : s; };
    cut_.mates.resize(mate_.size());
    for (Side s = 0; s < mate_.size(); ++s) cut_.mates[turned(s)] = mate_[s] == kNone ? kNone : turned(mate_[s]);
    cut_.triangles.reserve(triangles_.size());
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      poll_at(t);
      glm::uvec3 corners(corner_vertex_[3 * t], corner_vertex_[3 * t + 1], corner_vertex_[3 * t + 2]);
      if (flip_[t]) std::swap(corners.y, corners.z);
      cut_.triangles.push_back(corners);
    }
    for (Side s = 0; s < mate_.size(); ++s) {
      if (mate_[s] != kNone || is_cut_[s]) continue;
      glm::uvec2 edge(corner_vertex_[s], corner_vertex_[next_corner(s)]);
      if (flip_[s / 3]) std::swap(edge.x, edge.y);
      cut_.boundary.push_back(edge);
    }
    cut_.triangle_input = triangles_;
    cut_.reversed = flip_;
    add_aside_vertices();
    join_slots();
    tie_copies();
    count_double_sheet_faces();
  }

  /// Triangles set aside need vertices that outlive the decimation. These are tied vertices of the manifold if there
  /// are.
  void add_aside_vertices() {
    std::unordered_map<std::uint32_t, std::uint32_t> at_position;
    for (std::uint32_t v = 0; v < cut_.vertex_input.size(); ++v) {
      if (cut_.cause[v] != CutCause::none) at_position.try_emplace(weld_[cut_.vertex_input[v]], v);
    }
    for (const std::uint32_t i : cut_.aside) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t input = input_[i][k];
        if (cut_.input_vertex[input] != kNone) continue;
        const auto [entry, added] =
            at_position.try_emplace(weld_[input], static_cast<std::uint32_t>(cut_.vertex_input.size()));
        if (added) {
          cut_.vertex_input.push_back(input);
          cut_.cause.push_back(CutCause::degenerate);
        }
        cut_.input_vertex[input] = entry->second;
      }
    }
    if (triangles_.size() == input_.size()) return;
    // Input vertices that only dropped triangles use follow the vertex at their position.
    std::unordered_map<std::uint32_t, std::uint32_t> any;
    for (std::uint32_t i = 0; i < cut_.input_vertex.size(); ++i) {
      if (cut_.input_vertex[i] != kNone) any.try_emplace(weld_[i], cut_.input_vertex[i]);
    }
    for (const glm::uvec3& t : input_) {
      for (int k = 0; k < 3; ++k) {
        if (cut_.input_vertex[t[k]] == kNone) cut_.input_vertex[t[k]] = any.at(weld_[t[k]]);
      }
    }
  }

  void join_slots() {
    std::unordered_map<std::uint32_t, std::uint32_t> slot_at;
    cut_.output_slot.resize(cut_.vertex_input.size());
    for (std::uint32_t v = 0; v < cut_.output_slot.size(); ++v) {
      poll_at(v);
      cut_.output_slot[v] =
          cut_.cause[v] == CutCause::none ? v : slot_at.try_emplace(weld_[cut_.vertex_input[v]], v).first->second;
    }
  }

  void tie_copies() {
    std::vector<std::uint32_t> first(weld_.size(), kNone);  // is the first vertex at each weld representative
    std::vector<bool> several(weld_.size(), false);         // tells where there are several
    cut_.copies_of.resize(cut_.vertex_input.size());
    for (std::uint32_t v = 0; v < cut_.copies_of.size(); ++v) {
      poll_at(v);
      const std::uint32_t at = weld_[cut_.vertex_input[v]];
      if (first[at] == kNone) {
        first[at] = v;
      } else {
        several[at] = true;
      }
    }
    const std::vector<bool> is_apart = find_double_sheets(several);
    for (std::uint32_t v = 0; v < cut_.copies_of.size(); ++v) {
      const std::uint32_t at = weld_[cut_.vertex_input[v]];
      if (several[at] && !is_apart[at] && cut_.cause[v] == CutCause::none) cut_.cause[v] = CutCause::non_manifold;
      cut_.copies_of[v] = cut_.cause[v] == CutCause::none ? v : first[at];
    }
  }

  /// Counts the triangles at the places of another. One on the vertices of another was dropped as its duplicate.
  void count_double_sheet_faces() {
    if (!renamed_) return;
    std::vector<Side> sides;  // has for each triangle the side between its two lowest places
    for (Side s = 0; s < mate_.size(); s += 3) {
      const Side highest = std::max({s, s + 1, s + 2}, [&](Side a, Side b) { return welded(a) < welded(b); });
      sides.push_back(next_corner(highest));
    }
    const auto end_of = [&](Side corner) { return welded(corner); };
    std::vector<std::uint32_t> third;  // is the third place of each
    by_ends(sides, weld_.size(), team_, end_of, [&](const std::vector<Side>& alike) {
      third.clear();
      for (const Side s : alike) third.push_back(welded(previous_corner(s)));
      std::ranges::sort(third);
      for (std::size_t i = 0; i < third.size(); ++i) {
        const bool as_before = i > 0 && third[i] == third[i - 1];
        cut_.double_sheet_faces += as_before || (i + 1 < third.size() && third[i] == third[i + 1]);
      }
    });
  }

  /// The direction from a side into its triangle, at a right angle to the side. Not finite for a triangle without one.
  glm::dvec3 inwards(Side s) const {
    const glm::dvec3 &a = positions_[vertex(s)], &b = positions_[vertex(next_corner(s))];
    const glm::dvec3 along = glm::normalize(b - a), to_apex = positions_[vertex(previous_corner(s))] - a;
    return glm::normalize(to_apex - glm::dot(to_apex, along) * along);
  }

  /// Whether sheets lie upon each other on both sides of a common edge, whose sides are given: whether each triangle
  /// there leaves the edge in nearly the same direction as one of another sheet. Sheets with different diagonals do not
  /// lie on each other exactly.
  bool lie_on_each_other(const std::vector<Side>& alike) const {
    std::vector<std::pair<Side, glm::dvec3>> leaving;
    leaving.reserve(alike.size());
    for (const Side s : alike) leaving.emplace_back(s, inwards(s));
    return std::ranges::all_of(leaving, [&](const auto& one) {
      poll();
      return std::ranges::any_of(leaving, [&](const auto& other) {
        const bool is_of_another = other.first != one.first && other.first != mate_[one.first];
        return is_of_another && !(glm::dot(one.second, other.second) < kUpon);
      });
    });
  }

  /// Tells for each weld representative at which there are several vertices whether it is inside of sheets that lie on
  /// each other. Tied together, sheets with different diagonals could not be decimated at all. Where they end or part,
  /// and where sheets only touch along an edge, as two boxes do, they stay together.
  std::vector<bool> find_double_sheets(const std::vector<bool>& several) const {
    std::vector<bool> result(weld_.size(), false), meet(weld_.size(), false);
    std::vector<Side> sides;
    for (Side s = 0; s < mate_.size(); ++s) {
      if (several[welded(s)] && several[welded(next_corner(s))]) sides.push_back(s);
    }
    const auto end_of = [&](Side corner) { return welded(corner); };
    by_ends(sides, weld_.size(), team_, end_of, [&](const std::vector<Side>& alike) {
      if (alike.size() == 1 || (alike.size() == 2 && mate_[alike[0]] == alike[1])) return;
      std::vector<bool>& of_ends = lie_on_each_other(alike) ? result : meet;
      of_ends[welded(alike[0])] = of_ends[welded(next_corner(alike[0]))] = true;
    });
    for (Side s = 0; s < mate_.size(); ++s) {
      if (mate_[s] == kNone) meet[welded(s)] = meet[welded(next_corner(s))] = true;
    }
    for (std::size_t at = 0; at < result.size(); ++at) result[at] = result[at] && !meet[at];
    return result;
  }

  Team& team_;
  std::span<const glm::dvec3> positions_;
  std::span<const glm::uvec3> input_;
  std::vector<std::uint32_t> weld_;
  bool renamed_ = false;                      // tells whether some used vertex is not its own representative
  std::vector<std::uint32_t> triangles_;      // are the input triangles that go into the manifold
  std::vector<Side> mate_;                    // holds for each side the side joined to it
  std::vector<bool> is_cut_;                  // tells for each side whether it is cut, so that its vertices are tied
  bool oriented_ = true;                      // tells whether all sides were opposed when they were joined
  std::vector<bool> flip_;                    // marks triangles to turn over, so that joined sides are opposed
  std::vector<std::uint32_t> corner_vertex_;  // is the vertex of each corner, numbered by their first corners
  CutMesh cut_;
};

}  // namespace

CutMesh cut_to_manifold(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, Team& team) {
  return Cutter(vertices, triangles, team).run();
}

}  // namespace tolvol
