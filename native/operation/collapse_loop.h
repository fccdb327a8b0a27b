// SPDX-License-Identifier: GPL-3.0-or-later
/// The greedy edge-collapse loop: cheapest edge first, each collapse checked when its turn comes. Works on the cut
/// mesh, in the volume's frame; knows nothing of files, transforms or reports.
#pragma once

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <optional>
#include <unordered_map>
#include <vector>

#include "check/certificate.h"
#include "operation/coverage.h"
#include "operation/quadric.h"
#include "operation/ring_check.h"
#include "reference/progress.h"

namespace tolvol {

/// What every collapse must keep; a null pointer is a promise not asked for.
struct CollapseBounds {
  const TriangleCertificate* forward = nullptr;
  Coverage* backward = nullptr;
  const TriangleCertificate* boundary_forward = nullptr;  ///< on the reference's boundary edges
  Coverage* boundary_backward = nullptr;                  ///< elements are boundary edges, named by their first vertex
  RingCheck* rival = nullptr;                             ///< asked in place of all of them
  double within = 0;  ///< the provable distance; 0: nothing is promised, and no second position is tried
};

/// A position as it is stored, and in the frame: always mapped from what is stored.
struct Spot {
  glm::dvec3 stored, position;
};

struct CollapseInput {
  std::vector<glm::uvec3> triangles;  ///< an oriented manifold with boundary
  std::vector<Spot> spots;            ///< of the vertices
  std::vector<bool> pinned;           ///< per vertex: neither moves nor vanishes
  std::vector<std::uint32_t> slots;   ///< per vertex: equal for those that are one vertex of the result (all pinned)
  std::vector<glm::uvec3>
      wedges;                 ///< per triangle and corner: equal at a vertex where attributes are equal; may be empty
  bool on_reference = false;  ///< every triangle is one of the reference
  bool subset = false;        ///< every surviving vertex keeps its position
  /// Rounds a position in the frame to what can be stored.
  std::function<Spot(const glm::dvec3&)> store;
};

class CollapseLoop {
 public:
  CollapseLoop(CollapseInput input, const CollapseBounds& bounds);

  /// Collapses until no edge can or `target` triangles are left. O(n log n) without bounds. Throws Cancelled.
  void run(std::size_t target, Progress* progress);

  std::size_t triangle_count() const { return triangle_count_; }
  bool alive(std::uint32_t triangle) const {
    return !mesh_.status(OpenMesh::FaceHandle(static_cast<int>(triangle))).deleted();
  }
  /// The vertex that a vertex was merged into (itself when it survives).
  std::uint32_t survivor(std::uint32_t vertex) const;
  const glm::dvec3& position(std::uint32_t vertex) const { return positions_[vertex]; }
  const glm::dvec3& stored(std::uint32_t vertex) const { return stored_[vertex]; }
  /// Whether the vertex left its original position.
  bool moved(std::uint32_t vertex) const { return moved_[vertex]; }
  /// Where corner `corner` of a triangle takes its attributes: an input corner as 3 * triangle + corner.
  std::uint32_t corner_source(std::uint32_t triangle, int corner) const { return corner_source_[triangle][corner]; }

 private:
  using Halfedge = OpenMesh::HalfedgeHandle;
  using Edge = OpenMesh::EdgeHandle;
  struct Entry {
    double cost;
    std::uint32_t edge, stamp;
  };
  /// one_way: the end of higher rank stays where it is; either_way: one of the ends does; anywhere: the position is
  /// free.
  enum class Freedom { one_way, either_way, anywhere };
  /// How an edge would be collapsed: the start of `halfedge` merges into its end, which goes to `position`.
  struct Plan {
    Halfedge halfedge;
    glm::dvec3 position;
    double cost;
    Freedom freedom;
  };
  enum class Outcome { impossible, refused, done };

  void build(bool on_reference);
  std::uint32_t from(Halfedge h) const { return static_cast<std::uint32_t>(mesh_.from_vertex_handle(h).idx()); }
  std::uint32_t to(Halfedge h) const { return static_cast<std::uint32_t>(mesh_.to_vertex_handle(h).idx()); }
  std::optional<Plan> plan(Edge e) const;
  Plan free_plan(Halfedge h) const;
  int rank(std::uint32_t vertex) const;
  bool on_boundary(std::uint32_t v) const { return mesh_.is_boundary(OpenMesh::VertexHandle(static_cast<int>(v))); }
  void push(Edge e);
  void collapse(Edge e);
  Outcome search(Halfedge h, const glm::dvec3& best);
  Outcome attempt(Halfedge h, const Spot& spot);
  bool gather(Halfedge h, const glm::dvec3& position);
  void gather_side(Halfedge h, std::uint32_t vertex, const glm::dvec3& position, double moved);
  bool wedges_fit(Halfedge h);
  bool slots_fit(Halfedge h) const;
  bool joined_by_other(std::uint32_t a, std::uint32_t b) const;
  bool folds_over() const;
  bool within_bounds(const glm::dvec3& position);
  bool boundary_within_bounds(Halfedge h, const glm::dvec3& position);
  void apply(Halfedge h, const Spot& spot);
  Spot spot(std::uint32_t vertex) const { return {stored_[vertex], positions_[vertex]}; }
  void renew(std::uint32_t vertex);

  OpenMesh::TriConnectivity mesh_;
  CollapseBounds bounds_;
  bool subset_;
  std::function<Spot(const glm::dvec3&)> store_;
  std::vector<glm::uvec3> triangles_;
  std::vector<glm::dvec3> positions_, stored_;
  std::vector<bool> pinned_, seam_, moved_;
  std::vector<std::uint32_t> slots_;
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> copies_;  ///< by slot, where there are several
  std::vector<double> distance_;       ///< upper bound on each vertex's distance to the reference
  std::vector<double> face_distance_;  ///< the same for every point of a face
  std::vector<Quadric> quadrics_;
  std::vector<glm::uvec3> wedges_, corner_source_;
  mutable std::vector<std::uint32_t> merged_into_;
  std::vector<std::uint32_t> stamps_;
  std::vector<bool> refused_;  ///< edges that failed a bound and wait for their neighbourhood to change
  std::size_t refused_count_ = 0;
  std::vector<Entry> heap_;
  std::size_t triangle_count_ = 0;

  // The collapse under trial: the faces that survive it, as they would be.
  struct RingFace {
    int corner;         ///< which corner moves
    glm::dvec3 before;  ///< from here
    std::uint32_t vertices[3];
    double distance;  ///< upper bound on the distance of its points to the reference
  };
  std::vector<Coverage::Element> elements_;
  std::vector<RingFace> ring_;  ///< parallel to elements_
  std::vector<Coverage::Removed> removed_;
  std::vector<Coverage::Element> boundary_elements_;
  std::vector<Coverage::Removed> boundary_removed_;
  struct Corner {
    std::uint32_t wedge, source;
  };
  struct NewWedge {
    std::uint32_t triangle;
    int corner;
    Corner gained;
  };
  std::vector<NewWedge> new_wedges_;
  double new_distance_ = 0;
  std::size_t suspect_ =
      0;  ///< the face that failed last: of another try at the same collapse it is the likeliest to fail
};

}  // namespace tolvol
