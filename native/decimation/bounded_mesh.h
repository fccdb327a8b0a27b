// SPDX-License-Identifier: GPL-3.0-or-later
/// The mesh that a decimation works on: connectivity, positions, and the bounds that its changes must keep. It is in
/// the volume's frame, and knows nothing of files, transforms or reports. It changes by applying a Change.
#pragma once

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <atomic>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <unordered_map>
#include <vector>

#include "base/parallel.h"
#include "check/bounds.h"
#include "decimation/occupied.h"
#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"
#include "topology/new_crossings.h"

namespace tolvol {

class CertifiedBounds;
class Change;
class Regions;

struct BoundedMeshInput {
  std::vector<glm::uvec3> triangles;      ///< An oriented manifold with boundary.
  std::vector<std::uint32_t> mates;       ///< The mates of a CutMesh.
  std::vector<VertexPosition> positions;  ///< For each vertex.
  std::vector<bool>
      pinned;  ///< For each vertex: it neither moves nor vanishes, and an edge between two such vertices stays.
  std::vector<double>
      shares;  ///< For each vertex: the share of the forward bound that new faces around it may use. May be empty.
  std::vector<std::uint32_t> slots;  ///< For each vertex: equal for copies, which stay at one place: one of them.
  std::vector<bool> joined;          ///< For each vertex: an edge of it lies on edges of other sheets. May be empty.
  std::vector<glm::uvec3> wedges;    ///< For each corner: equal at a vertex where attributes are equal. May be empty.
  bool subset = false;               ///< Every surviving vertex keeps its position.
  /// A vertex that moves may be put only strictly inside this box of stored positions.
  Box cell{glm::dvec3(-std::numeric_limits<double>::infinity()), glm::dvec3(std::numeric_limits<double>::infinity())};
  /// Rounds a position in the frame to what can be stored.
  std::function<VertexPosition(const glm::dvec3&)> store;
};

class BoundedMesh {
 public:
  using Vertex = OpenMesh::VertexHandle;
  using Halfedge = OpenMesh::HalfedgeHandle;
  using Edge = OpenMesh::EdgeHandle;
  using Face = OpenMesh::FaceHandle;

  /// `bounds`: what its changes must keep, null for nothing. Keeps a reference to them.
  BoundedMesh(BoundedMeshInput input, Bounds* bounds, Team& team);

  const OpenMesh::TriConnectivity& connectivity() const { return mesh_; }
  Bounds* bounds() const { return bounds_; }
  /// The certificates, if they decide. Only then can a proof be put off, or a position be fitted to the reference.
  CertifiedBounds* certified() const { return certified_; }
  std::size_t triangle_count() const { return triangle_count_; }
  bool alive(std::uint32_t triangle) const { return !mesh_.status(face(triangle)).deleted(); }
  /// The vertex that a vertex was merged into (itself when it survives).
  std::uint32_t survivor(std::uint32_t vertex) const;
  const glm::uvec3& triangle(std::uint32_t triangle) const { return triangles_[triangle]; }
  // The triangles, those that are gone among them, and the positions in the frame, or as they are stored. Valid as
  // long as the mesh.
  MeshView frame_mesh() const { return {triangles_, positions_}; }
  MeshView stored_mesh() const { return {triangles_, stored_}; }
  const glm::dvec3& position(std::uint32_t vertex) const { return positions_[vertex]; }
  const glm::dvec3& stored(std::uint32_t vertex) const { return stored_[vertex]; }
  VertexPosition vertex_position(std::uint32_t vertex) const { return {stored_[vertex], positions_[vertex]}; }
  VertexPosition store(const glm::dvec3& position) const { return store_(position); }
  /// Whether a vertex may be put there: the stored type can hold the position, and it is strictly inside the cell.
  bool may_hold(const VertexPosition& p) const { return p.is_finite() && strictly_inside(p.stored, cell_); }
  /// Whether the vertex left its original position.
  bool left_original(std::uint32_t vertex) const { return left_original_[vertex] != 0; }
  /// The share of the forward bound that new faces around the vertex may use.
  double share(std::uint32_t vertex) const { return shares_.empty() ? 1 : shares_[vertex]; }
  /// The same for all vertices; empty if it is 1 for each. Valid as long as the mesh.
  std::span<const double> shares() const { return shares_; }
  /// How many faces have the vertex as a corner.
  std::uint32_t faces_around(std::uint32_t vertex) const {
    return faces_around_[vertex].load(std::memory_order_relaxed);
  }
  bool on_boundary(std::uint32_t vertex) const { return mesh_.is_boundary(handle(vertex)); }
  /// Whether some vertices of the kernel are one vertex of the result. A change of one of them then depends on where
  /// the others are.
  bool has_copies() const { return !copies_.empty(); }
  /// Whether the vertex has copies, or an edge that lies on edges of other sheets, so that a change there may change
  /// them, too.
  bool joined(std::uint32_t vertex) const { return joined_[vertex] != 0; }
  /// Whether a boundary edge of the kernel may be one that was cut, or lie on edges of other sheets, so that it is no
  /// boundary of the surface. It is also true for some edges that are; their ends are pinned wherever boundaries are
  /// bounded, so that to leave these edges out breaks no bound.
  bool is_cut(std::uint32_t from, std::uint32_t to) const { return joined(from) && joined(to); }
  /// The vertex and its copies: vertices of the kernel that are alive and at one place. Valid until the next change of
  /// one of them.
  std::span<const std::uint32_t> copies(std::uint32_t vertex) const {
    const auto found = copies_.find(slots_[vertex]);
    if (found != copies_.end()) return found->second;
    return {&merged_into_[vertex], 1};  // A vertex that is alive was merged into itself.
  }
  /// The slot of the vertex, which is equal for copies: the number of one of them.
  std::uint32_t slot(std::uint32_t vertex) const { return slots_[vertex]; }
  /// Whether an edge lies between the places of two vertices that is not the one between these two: one between copies.
  bool joined_by_other(std::uint32_t a, std::uint32_t b) const;
  bool pinned(std::uint32_t vertex) const { return pinned_[vertex]; }
  /// Whether the corners of faces have wedges.
  bool has_wedges() const { return !wedges_.empty(); }
  /// The wedge of a corner, where corners have wedges.
  std::uint32_t wedge(std::uint32_t triangle, int corner) const { return wedges_[triangle][corner]; }
  /// Where corner `corner` of a triangle takes its attributes: an input corner as 3 * triangle + corner.
  std::uint32_t corner_source(std::uint32_t triangle, int corner) const { return corner_source_[triangle][corner]; }

  std::uint32_t from(Halfedge h) const { return static_cast<std::uint32_t>(mesh_.from_vertex_handle(h).idx()); }
  std::uint32_t to(Halfedge h) const { return static_cast<std::uint32_t>(mesh_.to_vertex_handle(h).idx()); }
  static Vertex handle(std::uint32_t vertex) { return Vertex(static_cast<int>(vertex)); }
  static Face face(std::uint32_t triangle) { return Face(static_cast<int>(triangle)); }
  static Edge edge(std::uint32_t edge) { return Edge(static_cast<int>(edge)); }

  /// none: the edge stays. one_way: the start of `halfedge` may merge into its end, which stays where it is.
  /// either_way: or the other way around. anywhere: the end may also go to any position.
  enum class Freedom { none, one_way, either_way, anywhere };
  struct Merge {
    Freedom freedom;
    Halfedge halfedge;
  };
  /// How the ends of an edge may become one vertex, by what each of them must keep.
  Merge merge(Edge e) const;
  /// Whether a vertex may move by itself.
  bool movable(std::uint32_t vertex) const { return !joined(vertex) && movable_with_copies(vertex); }
  /// Whether a vertex may move along with its copies.
  bool movable_with_copies(std::uint32_t vertex) const;

  /// From now on no change puts a vertex where another is. Only one thread may apply changes then. O(n).
  void keep_apart();
  /// From now on no change of a vertex of a region puts it where another vertex in the region's cell is. Each region
  /// may have a thread that applies its changes. O(n).
  void keep_apart(const Regions& regions, Team& team);
  /// Whether the place of `target` belongs to a vertex other than these two, and vertices are kept apart.
  bool meets_another(const VertexPosition& target, std::uint32_t vertex, std::uint32_t other) const {
    return kept_apart() && target.stored != stored_[vertex] && target.stored != stored_[other] &&
           occupied_[occupied_by_[vertex]].contains(target.stored);
  }

  /// Carries out a change that is possible on this mesh as it is. ChangeTrial, which decides about changes, calls it.
  void apply(const Change& change);

  /// Some vertices and faces as they were, with the halfedges of these faces and those opposite to them at a boundary.
  struct Saved {
    using Kernel = OpenMesh::TriConnectivity;
    struct OfVertex {
      std::uint32_t vertex;
      VertexPosition position;
      double share;
      bool left_original;
    };
    struct OfFace {
      std::uint32_t face;
      glm::uvec3 triangle, wedges, corner_source;
      Kernel::Face kernel;
    };
    struct OfHalfedge {
      Halfedge halfedge;
      Kernel::Halfedge kernel;
    };
    struct Outgoing {  ///< The halfedge by which the kernel finds the others of a vertex.
      Vertex vertex;
      Halfedge halfedge;
    };
    std::vector<OfVertex> vertices;
    std::vector<OfFace> faces;
    std::vector<OfHalfedge> halfedges;
    std::vector<Outgoing> outgoing;
  };
  Saved save(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces) const;
  /// Takes back all changes since save(), of which each was one of the saved faces and moved saved vertices alone.
  void restore(const Saved& saved);

 private:
  void build(std::span<const std::uint32_t> mates, Team& team);
  int rank(std::uint32_t vertex) const;
  void count_around(const glm::uvec3& triangle, std::int32_t change);
  void merge_copies(const Change& change);
  void place(std::uint32_t vertex, const VertexPosition& target);
  bool kept_apart() const { return !occupied_.empty(); }

  OpenMesh::TriConnectivity mesh_;
  Bounds* bounds_;
  CertifiedBounds* certified_;
  bool subset_;
  std::function<VertexPosition(const glm::dvec3&)> store_;
  Box cell_;
  std::vector<glm::uvec3> triangles_;
  std::vector<glm::dvec3> positions_, stored_;
  std::vector<bool> pinned_, seam_;
  std::vector<std::atomic<std::uint32_t>> faces_around_;  ///< Regions share the vertices between them.
  std::vector<std::uint8_t> left_original_;               ///< Threads would write to one byte of a vector<bool>.
  std::vector<double> shares_;
  std::vector<std::uint8_t> joined_;  ///< Threads would write to one byte of a vector<bool>.
  std::vector<std::uint32_t> slots_;
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>>
      copies_;  ///< By slot, where a slot has several vertices.
  std::vector<glm::uvec3> wedges_, corner_source_;
  mutable std::vector<std::uint32_t> merged_into_;
  /// If vertices are kept apart: the places of the vertices in the cell of each region, or of all in one element.
  std::vector<Occupied> occupied_;
  /// For each vertex: the index in occupied_ of the places that a change of it must not meet. A vertex of no region has
  /// none.
  std::vector<std::uint32_t> occupied_by_;
  std::atomic<std::size_t> triangle_count_ = 0;
};

}  // namespace tolvol
