// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/patch.h"

namespace tolvol {

std::uint32_t Patch::add_vertex(std::uint32_t id) {
  const auto [at, is_new] = local_vertex_.try_emplace(id, static_cast<std::uint32_t>(vertex_count_));
  if (!is_new) return at->second;
  if (vertex_count_ == vertices_.size()) vertices_.emplace_back();
  Vertex& v = vertices_[vertex_count_++];
  v.id = id, v.position = mesh_->position(id), v.share = mesh_->share(id);
  v.free = false, v.pinned = mesh_->pinned(id), v.joined = mesh_->joined(id);
  v.faces.clear();
  return at->second;
}

bool Patch::gather(const Change& collapse, int rings, bool boundary_free) {
  mesh_ = &collapse.mesh();
  vertex_count_ = 0;
  kept_slot_ = mesh_->slot(*collapse.vertex()), merged_slot_ = mesh_->slot(mesh_->from(collapse.halfedge()));
  vanishing_vertices_.clear();
  for (const Change::Halfedge h : collapse.collapses()) vanishing_vertices_.push_back(mesh_->from(h));
  faces_.clear(), flips_.clear(), local_vertex_.clear(), local_face_.clear(), outer_edges_.clear();
  if (collapse.elements().size() > kMostFaces || !gather_core(collapse, rings)) return false;
  // The faces of the change come first, in its order, so that their numbers are those of its elements.
  for (const Coverage::Element& e : collapse.elements()) add_face(collapse, e.id);
  for (const std::uint32_t v : core_) {
    for (const auto f : mesh_->connectivity().vf_range(BoundedMesh::handle(v))) {
      if (faces_.size() == kMostFaces) return false;
      add_face(collapse, static_cast<std::uint32_t>(f.idx()));
    }
  }
  free_vertices(collapse, boundary_free);
  link();
  note_outer_edges();
  return true;
}

/// Finds the vertices whose faces are taken. Returns false if there are too many.
bool Patch::gather_core(const Change& collapse, int rings) {
  core_.clear();
  const auto add = [&](std::uint32_t v) {
    if (!in_core(v)) core_.push_back(v);
    return core_.size() <= kMostVertices;
  };
  for (const Change::Halfedge h : collapse.collapses()) {
    if (!add(mesh_->from(h)) || !add(mesh_->to(h))) return false;
  }
  for (const auto* copies : {&collapse.carried(), &collapse.moved_along()}) {
    if (!std::ranges::all_of(*copies, add)) return false;
  }
  std::size_t begin = 0;
  for (int ring = 1; ring < rings; ++ring) {
    const std::size_t end = core_.size();
    for (std::size_t i = begin; i < end; ++i) {
      for (const auto v : mesh_->connectivity().vv_range(BoundedMesh::handle(core_[i]))) {
        if (!add(static_cast<std::uint32_t>(v.idx()))) return false;
      }
    }
    begin = end;
  }
  return true;
}

void Patch::add_face(const Change& collapse, std::uint32_t id) {
  if (local_face_.contains(id)) return;
  if (std::ranges::any_of(collapse.removed(), [&](const Coverage::Removed& r) { return r.id == id; })) return;
  const std::size_t place = faces_.size();
  const bool changed = place < collapse.elements().size() && collapse.elements()[place].id == id;
  glm::uvec3 t = mesh_->triangle(id);
  if (changed) {
    const auto& v = collapse.faces()[place].vertices;
    t = {v[0], v[1], v[2]};
  }
  Face face{};
  face.id = id, face.changed = changed;
  for (int k = 0; k < 3; ++k) {
    face.corners[k] = add_vertex(t[k]);
    face.across[k] = kNone;
    face.wedges[k] = mesh_->has_wedges() ? mesh_->wedge(id, k) : 0;
  }
  local_face_.emplace(id, static_cast<std::uint32_t>(place));
  faces_.push_back(face);
}

void Patch::free_vertices(const Change& collapse, bool boundary_free) {
  for (Vertex& v : vertices()) {
    v.free = in_core(v.id) && mesh_->movable(v.id) && (boundary_free || !mesh_->on_boundary(v.id));
  }
  const auto place = [&](std::uint32_t id) {
    const std::uint32_t v = find_vertex(id);
    if (v == kNone) return;
    vertices_[v].position = collapse.position().position;
  };
  place(*collapse.vertex());
  Vertex& kept = vertices_[find_vertex(*collapse.vertex())];
  kept.share = collapse.share();
  kept.joined = kept.joined || mesh_->joined(mesh_->from(collapse.halfedge()));
  // Copies that are carried along do not move any further, so that the vertex to which they are carried must not.
  if (!collapse.carried().empty()) kept.free = false;
  for (const std::uint32_t v : collapse.carried()) {
    place(v);
    // It becomes a copy of the vertex that stays, and what holds for a vertex holds for its copies.
    Vertex& carried = vertices_[find_vertex(v)];
    carried.pinned = carried.pinned || kept.pinned;
    carried.share = std::min(carried.share, kept.share);
  }
  for (const std::uint32_t v : collapse.moved_along()) place(v);
  for (const Change::NewWedge& n : collapse.new_wedges()) {
    const std::uint32_t f = find_face(n.triangle);
    if (f != kNone) faces_[f].wedges[n.corner] = n.gained.wedge;
  }
}

/// Finds the faces around each vertex and across each edge.
void Patch::link() {
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    for (const std::uint32_t v : faces_[f].corners) vertices_[v].faces.push_back(f);
  }
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    Face& face = faces_[f];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = face.corners[k], to = face.corners[(k + 1) % 3];
      for (const std::uint32_t other : vertices_[from].faces) {
        const auto& c = faces_[other].corners;
        for (int j = 0; j < 3; ++j) {
          if (c[j] == to && c[(j + 1) % 3] == from) face.across[k] = other;
        }
      }
      face.boundary[k] = false;
    }
  }
}

/// Notes the edges of the mesh between two vertices here that are no edges of faces here, and the boundary edges.
void Patch::note_outer_edges() {
  const OpenMesh::TriConnectivity& connectivity = mesh_->connectivity();
  for (std::uint32_t a = 0; a < vertex_count_; ++a) {
    const std::uint32_t id = vertices_[a].id;
    if (in_core(id)) continue;
    for (const auto h : connectivity.voh_range(BoundedMesh::handle(id))) {
      const std::uint32_t b = find_vertex(mesh_->to(h));
      if (b == kNone) continue;
      const auto is_here = [&](BoundedMesh::Halfedge side) {
        const int face = connectivity.face_handle(side).idx();
        return face >= 0 && local_face_.contains(static_cast<std::uint32_t>(face));
      };
      if (!is_here(h) && !is_here(connectivity.opposite_halfedge_handle(h))) outer_edges_.emplace_back(a, b);
    }
  }
  std::sort(outer_edges_.begin(), outer_edges_.end());
  // All faces around a vertex of the core are here, so that its other edges without a second face are boundary edges.
  for (Face& face : faces_) {
    for (int k = 0; k < 3; ++k) {
      if (face.across[k] != kNone) continue;
      const std::uint32_t a = vertices_[face.corners[k]].id, b = vertices_[face.corners[(k + 1) % 3]].id;
      face.boundary[k] =
          in_core(a) || in_core(b) ||
          connectivity.is_boundary(connectivity.find_halfedge(BoundedMesh::handle(b), BoundedMesh::handle(a)));
    }
  }
}

bool Patch::joined_by_edge(std::uint32_t a, std::uint32_t b) const {
  if (std::binary_search(outer_edges_.begin(), outer_edges_.end(), std::pair(a, b)) ||
      std::binary_search(outer_edges_.begin(), outer_edges_.end(), std::pair(b, a))) {
    return true;
  }
  return std::ranges::any_of(vertices_[a].faces, [&](std::uint32_t f) {
    const auto& c = faces_[f].corners;
    return c[0] == b || c[1] == b || c[2] == b;
  });
}

/// Whether, after the collapse, an edge other than the one from a to b may lie between the same two places. It may say
/// so where BoundedMesh::joined_by_other() will not, and never the reverse.
bool Patch::may_be_joined_by_other(std::uint32_t a, std::uint32_t b) const {
  if (!vertices_[a].joined && !vertices_[b].joined) return false;
  // The collapse or another flip of this patch may make an edge between copies of the two.
  if (vertices_[a].joined && vertices_[b].joined) return true;
  const std::uint32_t one = vertices_[a].joined ? b : a, joined = vertices_[a].joined ? a : b;
  const std::uint32_t slot = slot_after_collapse(vertices_[joined].id);
  const auto is_copy = [&](std::uint32_t id) {
    return id != vertices_[joined].id && slot_after_collapse(id) == slot && !vanishes(id);
  };
  const auto has_copy = [&](std::uint32_t f) {
    return std::ranges::any_of(faces_[f].corners, [&](std::uint32_t v) { return is_copy(vertices_[v].id); });
  };
  if (std::ranges::any_of(vertices_[one].faces, has_copy)) return true;
  for (const auto near : mesh_->connectivity().vv_range(BoundedMesh::handle(vertices_[one].id))) {
    if (is_copy(static_cast<std::uint32_t>(near.idx()))) return true;
  }
  return false;
}

bool Patch::can_flip(std::uint32_t face, int k, Flipped& flipped) const {
  const std::uint32_t other = faces_[face].across[k];
  if (other == kNone) return false;
  // The faces (b, a, c) and (a, b, d) become (b, d, c) and (a, c, d), as in Change::prepare_flip().
  const Face &first = faces_[face], &second = faces_[other];
  int j = 0;
  while (second.corners[j] != first.corners[(k + 1) % 3]) ++j;
  const int b1 = k, a1 = (k + 1) % 3, c1 = (k + 2) % 3, a2 = j, b2 = (j + 1) % 3, d2 = (j + 2) % 3;
  const std::uint32_t a = first.corners[a1], b = first.corners[b1], c = first.corners[c1], d = second.corners[d2];
  if (c == d || (vertices_[a].pinned && vertices_[b].pinned) || joined_by_edge(c, d)) return false;
  if (may_be_joined_by_other(c, d)) return false;
  if (may_be_joined_by_other(a, b)) return false;  // The sheets would meet there no more.
  if (first.wedges[a1] != second.wedges[a2] || first.wedges[b1] != second.wedges[b2]) return false;
  flipped = {{face, other},
             {{b, d, c}, {a, c, d}},
             {{first.wedges[b1], second.wedges[d2], first.wedges[c1]},
              {second.wedges[a2], first.wedges[c1], second.wedges[d2]}}};
  return true;
}

void Patch::set_across(std::uint32_t face, std::uint32_t from, std::uint32_t to, std::uint32_t other) {
  if (face == kNone) return;
  for (int k = 0; k < 3; ++k) {
    if (faces_[face].corners[k] == from && faces_[face].corners[(k + 1) % 3] == to) faces_[face].across[k] = other;
  }
}

void Patch::flip(const Flipped& flipped) {
  Face &first = faces_[flipped.face[0]], &second = faces_[flipped.face[1]];
  const std::uint32_t b = flipped.corners[0][0], d = flipped.corners[0][1], c = flipped.corners[0][2],
                      a = flipped.corners[1][0];
  struct Side {
    std::uint32_t across;
    bool boundary;
  };
  const auto side = [](const Face& face, std::uint32_t from) {
    int k = 0;
    while (face.corners[k] != from) ++k;
    return Side{face.across[k], face.boundary[k]};
  };
  const Side ac = side(first, a), cb = side(first, c), bd = side(second, b), da = side(second, d);
  const std::uint32_t f0 = flipped.face[0], f1 = flipped.face[1];
  for (int k = 0; k < 3; ++k) {
    first.corners[k] = flipped.corners[0][k], second.corners[k] = flipped.corners[1][k];
    first.wedges[k] = flipped.wedges[0][k], second.wedges[k] = flipped.wedges[1][k];
  }
  const Side ends[2][3] = {{bd, {f1, false}, cb}, {ac, {f0, false}, da}};
  for (int k = 0; k < 3; ++k) {
    first.across[k] = ends[0][k].across, first.boundary[k] = ends[0][k].boundary;
    second.across[k] = ends[1][k].across, second.boundary[k] = ends[1][k].boundary;
  }
  set_across(bd.across, d, b, f0);
  set_across(ac.across, c, a, f1);
  first.changed = second.changed = true;
  std::erase(vertices_[a].faces, f0);
  std::erase(vertices_[b].faces, f1);
  vertices_[d].faces.push_back(f0);
  vertices_[c].faces.push_back(f1);
  flips_.push_back({vertices_[b].id, vertices_[a].id});
}

}  // namespace tolvol
