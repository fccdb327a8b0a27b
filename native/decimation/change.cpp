// SPDX-License-Identifier: GPL-3.0-or-later
// The link condition is that of OpenMesh's is_collapse_ok(), which marks vertices as it goes and so cannot serve two
// threads.
#include "decimation/change.h"

#include <algorithm>
#include <iterator>
#include <limits>

#include "decimation/is_turned.h"
#include "geometry/lengths.h"

namespace tolvol {
namespace {

/// The normal of a face may turn by less than the angle of this cosine.
constexpr double kFoldCosine = 0.2;

/// Whether the vertices are neighbours. O(faces around the one that has fewer), because both are walked around in turn.
bool are_neighbours(const OpenMesh::TriConnectivity& mesh, OpenMesh::VertexHandle a, OpenMesh::VertexHandle b) {
  auto around_a = mesh.cvv_iter(a), around_b = mesh.cvv_iter(b);
  for (; around_a.is_valid() && around_b.is_valid(); ++around_a, ++around_b) {
    if (*around_a == b || *around_b == a) return true;
  }
  return false;
}

/// Whether the vertices are neighbours, or have one in common other than `end`.
bool have_common_neighbour(const OpenMesh::TriConnectivity& mesh, OpenMesh::VertexHandle a, OpenMesh::VertexHandle b,
                           std::uint32_t end) {
  return std::ranges::any_of(mesh.vv_range(a), [&](const auto& near) {
    return near == b || (near != BoundedMesh::handle(end) && are_neighbours(mesh, near, b));
  });
}

bool turns_too_far(const glm::dvec3& before, const glm::dvec3& after) {
  // A degenerate face has no side to keep.
  return squared_length(before) > 0 && is_turned(before, after, kFoldCosine);
}

}  // namespace

bool Change::meets_another() const {
  if (kind_ == Kind::flip) return false;
  const std::uint32_t other = kind_ == Kind::collapse ? mesh_->from(halfedge_) : *vertex_;
  return mesh_->meets_another(position_, *vertex_, other);
}

void Change::clear(Kind kind, const VertexPosition& target) {
  kind_ = kind, vertex_.reset(), position_ = target, share_ = 1;
  collapses_.clear(), carried_.clear(), moved_along_.clear();
  elements_.clear(), faces_.clear(), removed_.clear(), vanishing_.clear(), new_wedges_.clear();
  boundary_.elements.clear(), boundary_.removed.clear(), boundary_.lies_on_others = false;
}

bool Change::prepare_collapse(Halfedge h, const VertexPosition& target) {
  clear(Kind::collapse, target);
  const std::uint32_t kept = mesh_->to(h);
  halfedge_ = h, vertex_ = kept;
  share_ = std::min(mesh_->share(kept), mesh_->share(mesh_->from(h)));
  collapses_.assign(1, h);
  if (mesh_->joined(mesh_->from(h)) && !gather_copies(h)) return false;
  for (const Halfedge each : collapses_) {
    vanishing_.push_back(mesh_->connectivity().face_handle(each).idx());
    vanishing_.push_back(mesh_->connectivity().opposite_face_handle(each).idx());
  }
  for (const Halfedge each : collapses_) {
    if (!link_condition(each) || !gather(each, target.position)) return false;
    if (mesh_->has_wedges() && !wedges_fit(each)) return false;
  }
  if (target.position != mesh_->position(kept)) {
    std::ranges::copy_if(mesh_->copies(kept), std::back_inserter(moved_along_),
                         [&](std::uint32_t copy) { return copy != kept; });
  }
  for (const std::uint32_t v : carried_) gather_side(v, target.position);
  for (const std::uint32_t copy : moved_along_) {
    // Those at which a collapse ends were gathered with it.
    if (std::ranges::none_of(collapses_, [&](Halfedge each) { return mesh_->to(each) == copy; })) {
      gather_side(copy, target.position);
    }
  }
  if (mesh_->has_copies() && !slots_fit()) return false;
  for (const Halfedge each : collapses_) {
    for (Face& face : faces_) {
      if (face.vertices[face.corner] == mesh_->from(each)) face.vertices[face.corner] = mesh_->to(each);
    }
  }
  gather_boundary();
  return true;
}

bool Change::prepare_relocate(std::uint32_t vertex, const VertexPosition& target) {
  clear(Kind::relocate, target);
  vertex_ = vertex, share_ = mesh_->share(vertex);
  gather_side(vertex, target.position);
  return true;
}

bool Change::prepare_flip(Edge e) {
  clear(Kind::flip, {});
  edge_ = e;
  const OpenMesh::TriConnectivity& mesh = mesh_->connectivity();
  if (mesh.is_boundary(e) || !mesh.is_flip_ok(e)) return false;
  const Halfedge h = mesh.halfedge_handle(e, 0), o = mesh.halfedge_handle(e, 1);
  // The faces (b, a, c) and (a, b, d) become (b, d, c) and (a, c, d); the kernel keeps their names that way around.
  const std::uint32_t a = mesh_->to(h), b = mesh_->to(o), c = mesh_->to(mesh.next_halfedge_handle(h)),
                      d = mesh_->to(mesh.next_halfedge_handle(o));
  if (mesh_->pinned(a) && mesh_->pinned(b)) return false;
  if (mesh_->has_copies()) {
    if (mesh_->slot(c) == mesh_->slot(d) || mesh_->joined_by_other(c, d)) return false;
    if (mesh_->joined_by_other(a, b)) return false;  // The sheets would meet there no more.
  }
  const std::uint32_t first = static_cast<std::uint32_t>(mesh.face_handle(h).idx()),
                      second = static_cast<std::uint32_t>(mesh.face_handle(o).idx());
  constexpr double kAnywhere = std::numeric_limits<double>::infinity();  // The change carries no point of a face along.
  const auto add = [&](std::uint32_t id, std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    elements_.push_back({id, {mesh_->position(x), mesh_->position(y), mesh_->position(z)}, kAnywhere});
    faces_.push_back({false, 0, mesh_->position(x), {x, y, z}});
  };
  add(first, b, d, c), add(second, a, c, d);
  if (!mesh_->has_wedges()) return true;
  const auto corner = [&](std::uint32_t f, std::uint32_t v) {
    const glm::uvec3& t = mesh_->triangle(f);
    const int k = t.x == v ? 0 : t.y == v ? 1 : 2;
    return Corner{mesh_->wedge(f, k), mesh_->corner_source(f, k)};
  };
  if (corner(first, a).wedge != corner(second, a).wedge || corner(first, b).wedge != corner(second, b).wedge) {
    return false;
  }
  new_wedges_ = {{first, 0, corner(first, b)},   {first, 1, corner(second, d)}, {first, 2, corner(first, c)},
                 {second, 0, corner(second, a)}, {second, 1, corner(first, c)}, {second, 2, corner(second, d)}};
  return true;
}

bool Change::link_condition(Halfedge h) {
  const OpenMesh::TriConnectivity& mesh = mesh_->connectivity();
  const auto v0 = mesh.from_vertex_handle(h), v1 = mesh.to_vertex_handle(h);
  if (mesh.status(mesh.edge_handle(h)).deleted() || mesh.status(v0).deleted() || mesh.status(v1).deleted())
    return false;
  const Halfedge o = mesh.opposite_halfedge_handle(h);
  int apex[2] = {-1, -1};
  for (const Halfedge side : {h, o}) {
    if (mesh.is_boundary(side)) continue;
    const Halfedge next = mesh.next_halfedge_handle(side), last = mesh.next_halfedge_handle(next);
    apex[side == o] = mesh.to_vertex_handle(next).idx();
    // A face that hangs on its edge alone would leave that edge bare.
    if (mesh.is_boundary(mesh.opposite_halfedge_handle(next)) && mesh.is_boundary(mesh.opposite_halfedge_handle(last)))
      return false;
  }
  if (apex[0] == apex[1]) return false;
  const bool fewer = mesh_->faces_around(mesh_->from(h)) <= mesh_->faces_around(mesh_->to(h));
  const auto end = fewer ? v0 : v1, other_end = fewer ? v1 : v0;
  for (const auto v : mesh.vv_range(end)) {
    const bool may_be_near_both = v == other_end || v.idx() == apex[0] || v.idx() == apex[1];
    if (!may_be_near_both && are_neighbours(mesh, v, other_end)) return false;
  }
  // Two places of a boundary may not be joined across the inside.
  return !(mesh.is_boundary(v0) && mesh.is_boundary(v1) && !mesh.is_boundary(h) && !mesh.is_boundary(o));
}

/// Adds the faces around a vertex, without those that vanish, as they would be with the vertex at `position`.
void Change::gather_side(std::uint32_t vertex, const glm::dvec3& position) {
  const double moved = glm::length(mesh_->position(vertex) - position);
  const OpenMesh::TriConnectivity& mesh = mesh_->connectivity();
  const Halfedge start = mesh.halfedge_handle(BoundedMesh::handle(vertex));
  Halfedge at = start;
  do {
    const int f = mesh.face_handle(at).idx();
    if (f >= 0 && std::find(vanishing_.begin(), vanishing_.end(), f) == vanishing_.end()) {
      const glm::uvec3& t = mesh_->triangle(static_cast<std::uint32_t>(f));
      const int corner = t.x == vertex ? 0 : t.y == vertex ? 1 : 2;
      Coverage::Element element{
          static_cast<std::uint32_t>(f), {mesh_->position(t.x), mesh_->position(t.y), mesh_->position(t.z)}, moved};
      element.corners[corner] = position;
      elements_.push_back(element);
      faces_.push_back({true, corner, mesh_->position(vertex), {t.x, t.y, t.z}});
    }
    at = mesh.next_halfedge_handle(mesh.opposite_halfedge_handle(at));
  } while (at != start);
}

bool Change::gather(Halfedge h, const glm::dvec3& position) {
  const OpenMesh::TriConnectivity& mesh = mesh_->connectivity();
  const std::uint32_t v0 = mesh_->from(h), v1 = mesh_->to(h);
  const double moved0 = glm::length(mesh_->position(v0) - position),
               moved1 = glm::length(mesh_->position(v1) - position);
  const std::size_t before = elements_.size();
  gather_side(v0, position);
  const std::size_t of_v0 = elements_.size() - before;
  // Faces around the kept vertex do not change when it stays where it is. Several collapses may end there.
  const Halfedge first = *std::ranges::find_if(collapses_, [&](Halfedge each) { return mesh_->to(each) == v1; });
  if (moved1 > 0 && first == h) gather_side(v1, position);

  const Halfedge o = mesh.opposite_halfedge_handle(h);
  std::uint32_t apex[2] = {Coverage::kNone, Coverage::kNone};
  for (int side = 0; side < 2; ++side) {
    const Halfedge edge = side == 0 ? h : o;
    const int f = mesh.face_handle(edge).idx();
    if (f < 0) continue;
    apex[side] = mesh_->to(mesh.next_halfedge_handle(edge));
    // The edge of the removed face at v0 is asked first, because the faces around v0 always are in the ring.
    Halfedge at_v0 = mesh.next_halfedge_handle(edge), at_v1 = mesh.prev_halfedge_handle(edge);
    if (side == 0) std::swap(at_v0, at_v1);
    int successor = mesh.opposite_face_handle(at_v0).idx();
    if (successor < 0) successor = mesh.opposite_face_handle(at_v1).idx();
    if (successor < 0) return false;
    std::size_t place = 0;
    while (place < elements_.size() && elements_[place].id != static_cast<std::uint32_t>(successor)) ++place;
    if (place == elements_.size()) {
      const glm::uvec3& t = mesh_->triangle(static_cast<std::uint32_t>(successor));
      elements_.push_back({static_cast<std::uint32_t>(successor),
                           {mesh_->position(t.x), mesh_->position(t.y), mesh_->position(t.z)},
                           0});
      faces_.push_back({false, 0, mesh_->position(t.x), {t.x, t.y, t.z}});
    }
    removed_.push_back({static_cast<std::uint32_t>(f), static_cast<std::uint32_t>(place), std::max(moved0, moved1)});
  }
  // A tetrahedron, the last closed shape, is kept, because two coinciding faces would be left of it.
  return !(of_v0 == 1 && apex[0] != Coverage::kNone && apex[1] != Coverage::kNone &&
           mesh.valence(BoundedMesh::handle(v1)) == 3 && !mesh_->on_boundary(v1));
}

bool Change::wedges_fit(Halfedge h) {
  const std::uint32_t v0 = mesh_->from(h), v1 = mesh_->to(h);
  const auto corner_of = [&](std::uint32_t f, std::uint32_t v) {
    return mesh_->triangle(f).x == v ? 0 : mesh_->triangle(f).y == v ? 1 : 2;
  };
  struct Side {
    std::uint32_t lost;  ///< The wedge at v0.
    Corner gained;       ///< The corner that takes its place at v1.
  };
  std::array<Side, 2> sides{};
  std::size_t count = 0;
  for (const Halfedge side : {h, mesh_->connectivity().opposite_halfedge_handle(h)}) {
    const int face = mesh_->connectivity().face_handle(side).idx();
    if (face < 0) continue;
    const std::uint32_t f = static_cast<std::uint32_t>(face);
    const int c0 = corner_of(f, v0), c1 = corner_of(f, v1);
    sides[count++] = {mesh_->wedge(f, c0), {mesh_->wedge(f, c1), mesh_->corner_source(f, c1)}};
  }
  // One wedge at v0 would have to become two at v1.
  if (count == 2 && sides[0].lost == sides[1].lost && sides[0].gained.wedge != sides[1].gained.wedge) return false;
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const Face& face = faces_[i];
    if (face.vertices[face.corner] != v0) continue;
    const std::uint32_t f = elements_[i].id, wedge = mesh_->wedge(f, face.corner);
    const auto side = std::find_if(sides.begin(), sides.begin() + static_cast<std::ptrdiff_t>(count),
                                   [&](const Side& s) { return s.lost == wedge; });
    if (side == sides.begin() + static_cast<std::ptrdiff_t>(count)) return false;
    new_wedges_.push_back({f, face.corner, side->gained});
  }
  return true;
}

/// Gathers what happens to the copies of the vertex that vanishes, in which several sheets meet. Where the sheets meet
/// along edges, each must have the edge that is collapsed, so that the line of edges becomes shorter. At the end of the
/// line one sheet may lie on two sides of it: then two edges of this sheet collapse into one vertex. Where the sheets
/// only touch, the other copies are carried along.
bool Change::gather_copies(Halfedge h) {
  const OpenMesh::TriConnectivity& mesh = mesh_->connectivity();
  const auto in_line = [&](Halfedge edge) { return mesh_->joined_by_other(mesh_->from(edge), mesh_->to(edge)); };
  bool line = false;
  collapses_.clear();
  for (const std::uint32_t copy : mesh_->copies(mesh_->from(h))) {
    const auto v = BoundedMesh::handle(copy);
    std::size_t edges = 0;
    for (const std::uint32_t end : mesh_->copies(*vertex_)) {
      const Halfedge edge = mesh.find_halfedge(v, BoundedMesh::handle(end));
      if (!edge.is_valid()) continue;
      if (edges++ > 0) return false;
      for (const Halfedge other : collapses_) {
        if (mesh_->to(other) == end && have_common_neighbour(mesh, mesh.from_vertex_handle(other), v, end))
          return false;
      }
      collapses_.push_back(edge);
    }
    if (edges == 0) carried_.push_back(copy);
    line = line || std::ranges::any_of(mesh.voh_range(v), in_line);
  }
  return !line || (carried_.empty() && in_line(h));
}

/// The link condition of the result, in which copies are one vertex: a vertex next to both ends is next to the edge,
/// no face comes to lie on another, and none has two corners at one place.
bool Change::slots_fit() {
  const std::uint32_t kept = *vertex_;
  const OpenMesh::TriConnectivity& mesh = mesh_->connectivity();
  apexes_.clear();
  for (const Halfedge edge : collapses_) {
    for (const Halfedge side : {edge, mesh.opposite_halfedge_handle(edge)}) {
      if (!mesh.is_boundary(side)) apexes_.push_back(mesh_->slot(mesh_->to(mesh.next_halfedge_handle(side))));
    }
  }
  const auto is_apex = [&](std::uint32_t slot) {
    return std::find(apexes_.begin(), apexes_.end(), slot) != apexes_.end();
  };
  around_.clear();
  for (const std::uint32_t copy : mesh_->copies(kept)) {
    for (const auto v : mesh.vv_range(BoundedMesh::handle(copy))) {
      around_.push_back(mesh_->slot(static_cast<std::uint32_t>(v.idx())));
    }
  }
  std::sort(around_.begin(), around_.end());
  // Whether a face joins the kept vertex with vertices of these two slots already.
  const auto has_face = [&](std::uint32_t a, std::uint32_t b) {
    return std::ranges::any_of(mesh_->copies(kept), [&](std::uint32_t copy) {
      return std::ranges::any_of(mesh.vf_range(BoundedMesh::handle(copy)), [&](const auto& f) {
        const glm::uvec3& t = mesh_->triangle(static_cast<std::uint32_t>(f.idx()));
        const auto has = [&](std::uint32_t slot) {
          return mesh_->slot(t.x) == slot || mesh_->slot(t.y) == slot || mesh_->slot(t.z) == slot;
        };
        return has(a) && has(b);
      });
    });
  };
  for (const Face& face : faces_) {
    if (!face.moves) continue;
    const std::uint32_t a = mesh_->slot(face.vertices[(face.corner + 1) % 3]),
                        b = mesh_->slot(face.vertices[(face.corner + 2) % 3]);
    if (mesh_->slot(face.vertices[face.corner]) == mesh_->slot(kept)) continue;
    if (a == b || a == mesh_->slot(kept) || b == mesh_->slot(kept)) return false;
    if (is_apex(a) && is_apex(b) && has_face(a, b)) return false;
    for (const std::uint32_t slot : {a, b}) {
      if (!is_apex(slot) && std::binary_search(around_.begin(), around_.end(), slot)) return false;
    }
  }
  return true;
}

bool Change::folds_over() const {
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const auto& c = elements_[i].corners;
    const Face& face = faces_[i];
    // With the moving corner as apex, both normals share the opposite edge.
    const glm::dvec3 &a = c[(face.corner + 1) % 3], &b = c[(face.corner + 2) % 3];
    if (turns_too_far(glm::cross(b - a, face.before - a), glm::cross(b - a, c[face.corner] - a))) return true;
  }
  return false;
}

/// Gathers the boundary edges as the collapse would leave them. Edges that were cut are none: they cover nothing.
void Change::gather_boundary() {
  const OpenMesh::TriConnectivity& connectivity = mesh_->connectivity();
  Halfedge edge = halfedge_;
  if (!connectivity.is_boundary(edge)) edge = connectivity.opposite_halfedge_handle(edge);
  if (!connectivity.is_boundary(edge)) return;
  // The boundary runs a -> s -> t -> c; s and t merge into one.
  const auto previous = connectivity.prev_halfedge_handle(edge), next = connectivity.next_halfedge_handle(edge);
  const std::uint32_t a = mesh_->from(previous), s = mesh_->from(edge), t = mesh_->to(edge), c = mesh_->to(next);
  const glm::dvec3 &p = position_.position, &pa = mesh_->position(a), &pc = mesh_->position(c);
  const double moved_s = glm::length(mesh_->position(s) - p), moved_t = glm::length(mesh_->position(t) - p);
  auto& [elements, removed, lies_on_others] = boundary_;
  if (vertex_ == t) {
    lies_on_others = mesh_->is_cut(a, t);
    elements.push_back({a, {pa, p, p}, moved_s});
    if (!mesh_->is_cut(t, c)) elements.push_back({t, {p, pc, pc}, moved_t});
    removed.push_back({s, 0, std::max(moved_s, moved_t)});
  } else {
    lies_on_others = mesh_->is_cut(s, c);
    elements.push_back({s, {p, pc, pc}, std::max(moved_s, moved_t)});
    if (!mesh_->is_cut(a, s)) elements.push_back({a, {pa, p, p}, moved_s});
    removed.push_back({t, 0, moved_t});
  }
}

}  // namespace tolvol
