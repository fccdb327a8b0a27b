// SPDX-License-Identifier: GPL-3.0-or-later
/// A copy of the faces around a collapse as the collapse would leave them, in which vertices may be moved and edges
/// flipped without changing the mesh. Nothing here knows of distances.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "decimation/bounded_mesh.h"
#include "decimation/change.h"

namespace tolvol {

class Patch {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  /// Three rings around an edge have about 44 vertices, and the faces around these are about 110.
  static constexpr std::size_t kMostVertices = 160, kMostFaces = 640;

  struct Vertex {
    std::uint32_t id;  ///< The vertex of the mesh.
    glm::dvec3 position;
    bool free;                         ///< Whether it may move: all its faces are in the patch then.
    double share;                      ///< The share of the forward bound that faces around it may use.
    bool pinned;                       ///< Whether an edge to another pinned vertex has to stay.
    bool joined;                       ///< Whether it has copies, or will have when the collapse is carried out.
    std::vector<std::uint32_t> faces;  ///< The faces of the patch around it, in no order.
  };
  struct Face {
    std::uint32_t id;  ///< The face of the mesh.
    std::uint32_t corners[3];
    std::uint32_t wedges[3];  ///< The wedge of each corner where the mesh has wedges.
    std::uint32_t across[3];  ///< The face of the patch beyond the edge from corner k to k + 1, or kNone.
    bool boundary[3];         ///< Whether this edge is a boundary edge of the mesh.
    bool changed;             ///< Whether the collapse or a flip has changed its corners.
  };
  /// A flip of the edge between two vertices.
  struct Flip {
    std::uint32_t from, to;
  };

  /// Takes the faces around all vertices that are less than `rings` edges away from the ends of a collapse that is
  /// possible. These vertices are free as far as the mesh lets them move; those on a boundary are free only where
  /// `boundary_free`. Returns false, and the patch is not to be used, if there are more than kMostVertices of them, or
  /// more than kMostFaces faces: a Relaxation would take seconds, and its matrix gigabytes. O(faces).
  bool gather(const Change& collapse, int rings, bool boundary_free);

  std::span<Vertex> vertices() { return std::span(vertices_).first(vertex_count_); }
  std::span<const Vertex> vertices() const { return std::span(vertices_).first(vertex_count_); }
  std::span<const Face> faces() const { return faces_; }
  const glm::dvec3& position(std::uint32_t face, int corner) const {
    return vertices_[faces_[face].corners[corner]].position;
  }
  /// The normal of a face, or of one with these corners, as long as twice its area.
  glm::dvec3 normal(std::uint32_t face) const { return normal(faces_[face].corners); }
  glm::dvec3 normal(const std::uint32_t (&corners)[3]) const {
    const glm::dvec3& a = vertices_[corners[0]].position;
    return glm::cross(vertices_[corners[1]].position - a, vertices_[corners[2]].position - a);
  }
  /// The place in the patch of a face or of a vertex of the mesh, or kNone.
  std::uint32_t find_face(std::uint32_t id) const { return found(local_face_, id); }
  std::uint32_t find_vertex(std::uint32_t id) const { return found(local_vertex_, id); }
  /// The flips so far, in order.
  std::span<const Flip> flips() const { return flips_; }

  /// The two faces at an edge as its flip would leave them, and that edge's new ends.
  struct Flipped {
    std::uint32_t face[2];
    std::uint32_t corners[2][3];
    std::uint32_t wedges[2][3];
  };
  /// Whether the edge from corner k to k + 1 of a face may be flipped, as far as connectivity and wedges go.
  bool can_flip(std::uint32_t face, int k, Flipped& flipped) const;
  /// Carries out a flip that may be made.
  void flip(const Flipped& flipped);

 private:
  static std::uint32_t found(const std::unordered_map<std::uint32_t, std::uint32_t>& map, std::uint32_t id) {
    const auto at = map.find(id);
    return at == map.end() ? kNone : at->second;
  }
  bool gather_core(const Change& collapse, int rings);
  bool in_core(std::uint32_t id) const { return std::find(core_.begin(), core_.end(), id) != core_.end(); }
  std::uint32_t add_vertex(std::uint32_t id);
  void add_face(const Change& collapse, std::uint32_t id);
  void free_vertices(const Change& collapse, bool boundary_free);
  void link();
  void note_outer_edges();
  bool joined_by_edge(std::uint32_t a, std::uint32_t b) const;
  bool may_be_joined_by_other(std::uint32_t a, std::uint32_t b) const;
  /// The slot of a vertex of the mesh once the collapse has been carried out.
  std::uint32_t slot_after_collapse(std::uint32_t id) const {
    const std::uint32_t slot = mesh_->slot(id);
    return slot == merged_slot_ ? kept_slot_ : slot;
  }
  bool vanishes(std::uint32_t id) const {
    return std::ranges::find(vanishing_vertices_, id) != vanishing_vertices_.end();
  }
  void set_across(std::uint32_t face, std::uint32_t from, std::uint32_t to, std::uint32_t other);

  const BoundedMesh* mesh_ = nullptr;
  std::vector<Vertex> vertices_;  ///< Those beyond vertex_count_ keep their memory for the next patch.
  std::size_t vertex_count_ = 0;
  std::vector<Face> faces_;
  std::vector<Flip> flips_;
  std::unordered_map<std::uint32_t, std::uint32_t> local_vertex_, local_face_;
  std::uint32_t kept_slot_ = 0, merged_slot_ = 0;  ///< Those of the ends of the collapse.
  std::vector<std::uint32_t> vanishing_vertices_;  ///< The vertices that the collapse takes away.
  std::vector<std::uint32_t> core_;                ///< The vertices of the mesh whose faces are taken.
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      outer_edges_;  ///< Edges of the mesh that no face here has; sorted.
};

}  // namespace tolvol
