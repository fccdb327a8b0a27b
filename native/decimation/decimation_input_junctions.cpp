// SPDX-License-Identifier: GPL-3.0-or-later
// What becomes of the T-junctions of a decimation's input: they are joined, or pinned where that cannot be.
#include <algorithm>
#include <array>
#include <iterator>
#include <map>

#include "decimation/decimation_input.h"
#include "geometry/closest_point.h"
#include "topology/t_junctions.h"

namespace tolvol {

/// The cut mesh with positions as they are stored.
TriangleMesh DecimationInput::stored_cut() const {
  TriangleMesh stored{std::vector<glm::dvec3>(cut_.vertex_input.size()), cut_.triangles};
  for (std::size_t v = 0; v < stored.vertices.size(); ++v) stored.vertices[v] = vertices_[cut_.vertex_input[v]];
  return stored;
}

/// The open edges at which a face that may change can have a T-junction, but for rounding at the sides of a cell. With
/// a cell they are those whose boxes meet it. All other open edges are of faces that stay, and most of them are open
/// only because the input is a part of a mesh.
std::vector<glm::uvec2> DecimationInput::open_edges() const {
  if (!options_.cell) return cut_.boundary;
  std::vector<glm::uvec2> open;
  std::ranges::copy_if(cut_.boundary, std::back_inserter(open), [&](const glm::uvec2& edge) {
    Box box;
    for (int k = 0; k < 2; ++k) box.add(vertices_[cut_.vertex_input[edge[k]]]);
    return meet(box, *options_.cell);
  });
  return open;
}

/// Puts vertices into the edges and triangles that they lie on, if it may. Returns whether there are T-junctions.
bool DecimationInput::join_t_junctions(bool may_divide, Team& team) {
  const std::vector<glm::uvec2> open = open_edges();
  if (open.empty()) return false;
  may_divide = may_divide && !options_.cell;  // The faces at the rim of a cell are other cells', too.
  const TJunctions found = find_t_junctions(stored_cut(), open, space_.unit_roundoff(), team);
  if (found.empty()) return false;
  if (!may_divide) return true;
  std::vector<TJunction> junctions = found.vertices;
  for (TJunction& j : junctions) {
    j.vertex = cut_.vertex_input[j.vertex];
    for (int k = 0; k < 3; ++k) j.on[k] = cut_.vertex_input[j.on[k]];
  }
  std::erase_if(junctions, [&](const TJunction& j) { return !may_join(j); });
  joined_ = tolvol::join_t_junctions(vertices_, triangles_, junctions, space_.unit_roundoff(), team);
  if (!joined_) return true;
  triangles_ = joined_->triangles;
  if (!wedges_.empty()) label_joined_wedges();
  cut_ = cut_to_manifold(vertices_, triangles_, team);
  return true;
}

/// Whether an edge or a triangle may be divided at a vertex: it is not to stay as it is, and the pieces are so near to
/// it that they are within the tolerance.
bool DecimationInput::may_join(const TJunction& j) const {
  const auto is_locked = [&](std::uint32_t v) { return !options_.locked.empty() && options_.locked[v]; };
  if (is_locked(j.on.x) && is_locked(j.on.y) && is_locked(j.on.z)) return false;
  if (!volume_) return true;
  const auto at = [&](std::uint32_t v) { return space_.frame(vertices_[v]); };
  // What an operation has left may use all of the tolerance but its headroom.
  const double most = volume_->frame_tolerance() * (own_count_ > 0 ? 1.0 / 16 : kHeadroom / 4);
  return closest_point(at(j.vertex), at(j.on.x), at(j.on.y), at(j.on.z)).distance_squared <= most * most;
}

/// Gives the corners of pieces labels. A corner that was put in has the same wedge in pieces on one edge whose ends
/// have the same wedges in both, and else in pieces of one triangle.
void DecimationInput::label_joined_wedges() {
  using Key = std::array<std::uint64_t, 4>;  // the vertex, and the ends with their labels or the triangle
  std::map<Key, std::uint32_t> labels;
  std::uint32_t next = *std::ranges::max_element(wedges_) + 1;
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    const std::uint32_t parent = joined_->parent[t];
    const glm::uvec3& whole = input_triangles_[parent];
    const glm::dmat3 weights = joined_->is_piece[t] ? weights_in_parent(t) : glm::dmat3(1);
    for (int k = 0; k < 3; ++k) {
      std::vector<std::uint64_t> ends;
      for (int c = 0; c < 3; ++c) {
        const std::uint64_t label = wedges_[3 * parent + static_cast<std::uint32_t>(c)];
        if (weights[k][c] > 0) ends.push_back(std::uint64_t{whole[c]} << 32 | label);
      }
      if (ends.size() == 1) {
        joined_wedges_.push_back(static_cast<std::uint32_t>(ends.front()));
        continue;
      }
      std::ranges::sort(ends);
      const std::uint64_t of_face = ends.size() == 3 ? std::uint64_t{parent} + 1 : 0;
      const auto [label, added] = labels.try_emplace({triangles_[t][k], ends[0], ends[1], of_face}, next);
      next += added;
      joined_wedges_.push_back(label->second);
    }
  }
  wedges_ = joined_wedges_;
}

glm::dmat3 DecimationInput::weights_in_parent(std::uint32_t triangle) const {
  glm::dmat3 weights(1);
  if (!is_piece(triangle)) return weights;
  const glm::uvec3& whole = input_triangles_[joined_->parent[triangle]];
  const glm::dvec3 &a = vertices_[whole.x], &b = vertices_[whole.y], &c = vertices_[whole.z];
  for (int k = 0; k < 3; ++k) weights[k] = closest_point(vertices_[triangles_[triangle][k]], a, b, c).weights;
  return weights;
}

/// Pins what holds the T-junctions together that could not be joined: faces that meet there share no edge along which
/// they could be kept together while it moves.
void DecimationInput::pin_t_junctions(Team& team) {
  for (const std::uint32_t v : t_junctions(stored_cut(), open_edges(), space_.unit_roundoff(), team)) {
    pin(v, "T-junction");
  }
}

}  // namespace tolvol
