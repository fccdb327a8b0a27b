// SPDX-License-Identifier: GPL-3.0-or-later
// OpenMesh holds the connectivity. Faces keep the indices of the input; deleted ones are only marked.
#include "decimation/bounded_mesh.h"

#include <algorithm>

#include "base/call.h"
#include "decimation/certified_bounds.h"
#include "decimation/change.h"
#include "decimation/regions.h"
#include "topology/connectivity.h"

namespace tolvol {

BoundedMesh::BoundedMesh(BoundedMeshInput input, Bounds* bounds, Team& team)
    : bounds_(bounds),
      certified_(dynamic_cast<CertifiedBounds*>(bounds)),
      subset_(input.subset),
      store_(std::move(input.store)),
      cell_(input.cell),
      triangles_(std::move(input.triangles)),
      pinned_(std::move(input.pinned)),
      shares_(std::move(input.shares)),
      joined_(input.joined.begin(), input.joined.end()),
      slots_(std::move(input.slots)),
      wedges_(std::move(input.wedges)) {
  for (const VertexPosition& s : input.positions) positions_.push_back(s.position), stored_.push_back(s.stored);
  build(input.mates, team);
}

void BoundedMesh::build(std::span<const std::uint32_t> mates, Team& team) {
  mesh_.request_vertex_status();
  mesh_.request_edge_status();
  mesh_.request_halfedge_status();
  mesh_.request_face_status();
  const std::size_t n = positions_.size(), m = triangles_.size();
  connect(n, triangles_, mates, mesh_, team);
  triangle_count_ = m;
  joined_.resize(n, false);
  for (std::uint32_t v = 0; v < n; ++v) {
    if (slots_[v] == v) continue;
    copies_.try_emplace(slots_[v], 1, slots_[v]).first->second.push_back(v);
    joined_[v] = joined_[slots_[v]] = true;
  }
  faces_around_ = std::vector<std::atomic<std::uint32_t>>(n);
  for (const glm::uvec3& t : triangles_) count_around(t, 1);
  left_original_.assign(n, false);
  seam_.assign(n, false);
  merged_into_.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) merged_into_[i] = i;
  corner_source_.resize(m);
  for (std::uint32_t i = 0; i < m; ++i) corner_source_[i] = {3 * i, 3 * i + 1, 3 * i + 2};
  if (!wedges_.empty()) {
    constexpr std::uint32_t kNoWedge = 0xFFFFFFFFu;
    std::vector<std::uint32_t> first(n, kNoWedge);
    for (std::size_t i = 0; i < m; ++i) {
      for (int k = 0; k < 3; ++k) {
        std::uint32_t& wedge = first[triangles_[i][k]];
        if (wedge == kNoWedge) wedge = wedges_[i][k];
        if (wedge != wedges_[i][k]) seam_[triangles_[i][k]] = true;
      }
    }
  }
}

/// Adds to the counts at the corners of a triangle.
void BoundedMesh::count_around(const glm::uvec3& triangle, std::int32_t change) {
  for (int k = 0; k < 3; ++k) {
    faces_around_[triangle[k]].fetch_add(static_cast<std::uint32_t>(change), std::memory_order_relaxed);
  }
}

std::uint32_t BoundedMesh::survivor(std::uint32_t v) const {
  while (merged_into_[v] != v) v = merged_into_[v] = merged_into_[merged_into_[v]];
  return v;
}

bool BoundedMesh::joined_by_other(std::uint32_t a, std::uint32_t b) const {
  // Many sheets may meet at one of the two places.
  if (copies(a).size() > copies(b).size()) std::swap(a, b);
  for (const std::uint32_t x : copies(a)) {
    for (const auto near : mesh_.vv_range(handle(x))) {
      const auto y = static_cast<std::uint32_t>(near.idx());
      if (slots_[y] == slots_[b] && (x != a || y != b)) return true;
    }
  }
  return false;
}

/// The rank of a vertex in a merge: the vertex of higher rank is the one that stays.
int BoundedMesh::rank(std::uint32_t vertex) const {
  if (pinned_[vertex]) return 5;
  return joined(vertex) ? 4 : (seam_[vertex] ? 2 : 0) + (on_boundary(vertex) ? 1 : 0);
}

bool BoundedMesh::movable_with_copies(std::uint32_t vertex) const {
  return !subset_ && !pinned_[vertex] &&
         std::ranges::none_of(copies(vertex), [&](std::uint32_t v) { return seam_[v]; });
}

BoundedMesh::Merge BoundedMesh::merge(Edge e) const {
  const Halfedge h = mesh_.halfedge_handle(e, 0);
  const std::uint32_t v0 = from(h), v1 = to(h);
  const int rank0 = rank(v0), rank1 = rank(v1);
  if ((pinned_[v0] && pinned_[v1]) || slots_[v0] == slots_[v1]) return {Freedom::none, h};
  // A point in which sheets touch may slide along the boundary of one of them.
  if (joined(v0) != joined(v1) && !pinned_[v0] && !pinned_[v1] && wedges_.empty() && mesh_.is_boundary(e)) {
    if (subset_) return {Freedom::either_way, h};
    return {Freedom::anywhere, joined(v0) ? mesh_.opposite_halfedge_handle(h) : h};
  }
  // A boundary vertex never leaves the boundary, not even for a vertex that must stay.
  if (rank0 > rank1 && on_boundary(v1) && !on_boundary(v0)) return {Freedom::none, h};
  if (rank1 > rank0 && on_boundary(v0) && !on_boundary(v1)) return {Freedom::none, h};
  if (rank0 == rank1) {
    return {movable_with_copies(v0) && movable_with_copies(v1) ? Freedom::anywhere : Freedom::either_way, h};
  }
  return {Freedom::one_way, rank0 > rank1 ? mesh_.opposite_halfedge_handle(h) : h};
}

void BoundedMesh::keep_apart() {
  occupied_.assign(1, {}), occupied_by_.assign(positions_.size(), 0);
  for (std::uint32_t v = 0; v < positions_.size(); ++v) {
    poll_at(v);
    if (!mesh_.status(handle(v)).deleted()) occupied_[0].add(stored_[v]);
  }
}

void BoundedMesh::keep_apart(const Regions& regions, Team& team) {
  std::vector<std::vector<std::uint32_t>> in_cell(regions.count());  // per region: the vertices in its cell
  occupied_by_.resize(positions_.size());
  for (std::uint32_t v = 0; v < positions_.size(); ++v) {
    poll_at(v);
    occupied_by_[v] = regions.of_vertex(v);
    if (mesh_.status(handle(v)).deleted()) continue;
    Box point;
    point.add(stored_[v]);
    regions.for_each_meeting(point, [&](std::uint32_t region) { in_cell[region].push_back(v); });
  }
  occupied_.assign(regions.count(), {});
  team.run(regions.count(), 1, [&](std::size_t region, std::size_t) {
    for (const std::uint32_t v : in_cell[region]) occupied_[region].add(stored_[v]);
  });
}

void BoundedMesh::place(std::uint32_t vertex, const VertexPosition& target) {
  if (kept_apart()) {
    Occupied& occupied = occupied_[occupied_by_[vertex]];
    occupied.remove(stored_[vertex]), occupied.add(target.stored);
  }
  left_original_[vertex] = left_original_[vertex] || target.position != positions_[vertex];
  positions_[vertex] = target.position;
  stored_[vertex] = target.stored;
}

/// Makes the copies of the vertex that vanishes, as far as they do not vanish, copies of the vertex that stays.
void BoundedMesh::merge_copies(const Change& change) {
  const std::uint32_t kept_vertex = *change.vertex();
  const std::uint32_t merged = slots_[from(change.halfedge())], kept = slots_[kept_vertex];
  copies_.erase(merged);
  if (!change.carried().empty()) {
    std::vector<std::uint32_t>& all = copies_.try_emplace(kept, 1, kept_vertex).first->second;
    all.insert(all.end(), change.carried().begin(), change.carried().end());
  }
  for (const std::uint32_t v : change.carried()) {
    slots_[v] = kept;
    place(v, change.position());
  }
  // What holds for a vertex holds for its copies.
  const auto of_all = copies(kept_vertex);
  const bool is_pinned = std::ranges::any_of(of_all, [&](std::uint32_t v) { return pinned_[v]; });
  double least = change.share();
  for (const std::uint32_t v : of_all) least = std::min(least, share(v));
  for (const std::uint32_t v : of_all) {
    joined_[v] = true;
    if (is_pinned) pinned_[v] = true;
    if (!shares_.empty()) shares_[v] = least;
  }
}

void BoundedMesh::apply(const Change& change) {
  for (const Change::NewWedge& n : change.new_wedges()) {
    wedges_[n.triangle][n.corner] = n.gained.wedge;
    corner_source_[n.triangle][n.corner] = n.gained.source;
  }
  const bool is_flip = change.kind() == Change::Kind::flip;
  for (std::size_t i = 0; i < change.faces().size(); ++i) {
    const Change::Face& face = change.faces()[i];
    const std::uint32_t id = change.elements()[i].id;
    const glm::uvec3 triangle(face.vertices[0], face.vertices[1], face.vertices[2]);
    if (is_flip) count_around(triangles_[id], -1), count_around(triangle, 1);
    triangles_[id] = triangle;
  }
  if (is_flip) {
    mesh_.flip(change.edge());
    return;
  }
  if (change.kind() == Change::Kind::collapse) {
    for (const Coverage::Removed& r : change.removed()) count_around(triangles_[r.id], -1);
    triangle_count_ -= change.removed().size();
    if (joined(from(change.halfedge()))) merge_copies(change);
    for (const Halfedge h : change.collapses()) {
      const std::uint32_t merged = from(h), kept = to(h);
      merged_into_[merged] = kept;
      if (kept_apart()) occupied_[occupied_by_[merged]].remove(stored_[merged]);
      if (!shares_.empty()) shares_[kept] = std::min(shares_[kept], shares_[merged]);
      faces_around_[kept].fetch_add(faces_around_[merged].exchange(0, std::memory_order_relaxed),
                                    std::memory_order_relaxed);
      collapse(mesh_, h);
    }
  }
  for (const std::uint32_t copy : copies(*change.vertex())) place(copy, change.position());
}

BoundedMesh::Saved BoundedMesh::save(std::span<const std::uint32_t> vertices,
                                     std::span<const std::uint32_t> faces) const {
  Saved saved;
  for (const std::uint32_t v : vertices) {
    saved.vertices.push_back({v, vertex_position(v), share(v), left_original(v)});
  }
  for (const std::uint32_t f : faces) {
    saved.faces.push_back(
        {f, triangles_[f], has_wedges() ? wedges_[f] : glm::uvec3(0), corner_source_[f], mesh_.face(face(f))});
    for (const Halfedge h : mesh_.fh_range(face(f))) {
      const Vertex start = mesh_.from_vertex_handle(h);
      const Halfedge opposite = mesh_.opposite_halfedge_handle(h);
      saved.halfedges.push_back({h, mesh_.halfedge(h)});
      saved.outgoing.push_back({start, mesh_.halfedge_handle(start)});
      if (mesh_.is_boundary(opposite)) saved.halfedges.push_back({opposite, mesh_.halfedge(opposite)});
    }
  }
  return saved;
}

void BoundedMesh::restore(const Saved& saved) {
  for (const Saved::OfHalfedge& s : saved.halfedges) {
    mesh_.halfedge(s.halfedge) = s.kernel;
    mesh_.status(s.halfedge).set_deleted(false);
    mesh_.status(mesh_.edge_handle(s.halfedge)).set_deleted(false);
  }
  for (const Saved::OfHalfedge& s : saved.halfedges) {  // This also sets the names in its neighbours.
    mesh_.set_next_halfedge_handle(s.halfedge, mesh_.next_halfedge_handle(s.halfedge));
    mesh_.set_next_halfedge_handle(mesh_.prev_halfedge_handle(s.halfedge), s.halfedge);
  }
  for (const Saved::Outgoing& s : saved.outgoing) mesh_.set_halfedge_handle(s.vertex, s.halfedge);
  for (const Saved::OfFace& s : saved.faces) {
    if (alive(s.face)) {
      count_around(triangles_[s.face], -1);
    } else {
      ++triangle_count_;
    }
    count_around(s.triangle, 1);
    mesh_.face(face(s.face)) = s.kernel;
    mesh_.status(face(s.face)).set_deleted(false);
    triangles_[s.face] = s.triangle;
    corner_source_[s.face] = s.corner_source;
    if (has_wedges()) wedges_[s.face] = s.wedges;
  }
  for (const Saved::OfVertex& s : saved.vertices) {
    if (kept_apart()) {
      Occupied& occupied = occupied_[occupied_by_[s.vertex]];
      if (!mesh_.status(handle(s.vertex)).deleted()) occupied.remove(stored_[s.vertex]);
      occupied.add(s.position.stored);
    }
    mesh_.status(handle(s.vertex)).set_deleted(false);
    positions_[s.vertex] = s.position.position, stored_[s.vertex] = s.position.stored;
    if (!shares_.empty()) shares_[s.vertex] = s.share;
    left_original_[s.vertex] = s.left_original;
    merged_into_[s.vertex] = s.vertex;
  }
}

}  // namespace tolvol
