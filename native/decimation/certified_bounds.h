// SPDX-License-Identifier: GPL-3.0-or-later
/// Bounds that are proved: every point of the mesh is within the tolerance of the reference; if asked for, of a
/// triangle of it that its face is not turned away from, every point of the reference is within the tolerance of the
/// mesh, and the boundaries are within it of each other. The class keeps account of what is known of every vertex and
/// face, in the volume's frame.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "check/bounds.h"
#include "check/certificate.h"
#include "check/coverage.h"
#include "check/facing.h"
#include "decimation/face_bound.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class CertifiedBounds final : public Bounds {
 public:
  /// The checks of each direction; a null pointer is a promise that is not asked for.
  struct Directions {
    const TriangleCertificate& forward;
    Coverage* backward = nullptr;                           ///< Its elements are triangles of the mesh.
    const TriangleCertificate* boundary_forward = nullptr;  ///< It is about the reference's boundary edges.
    Coverage* boundary_backward = nullptr;  ///< Its elements are boundary edges, named by their first vertex.
    const FacingRule* facing = nullptr;     ///< The rule that witnesses of the forward direction keep.
  };
  /// Makes the bounds for a mesh before any change. `on_reference` has the triangle of the reference that each triangle
  /// is, or Hierarchy::kNone; or it is empty if they are no triangles of it. Keeps references to the checks and the
  /// rule. Takes about 1 us for each vertex that is on no triangle of the reference; the threads of the team share
  /// this.
  CertifiedBounds(const Directions& directions, MeshView mesh, Team& team,
                  std::span<const std::uint32_t> on_reference = {});

  std::unique_ptr<Trial> trial() override;
  /// A trial that asks only where the vertex is: a DeferredProof has to prove the rest.
  std::unique_ptr<Trial> trial_on_trust();

  const TriangleCertificate& forward() const { return directions_.forward; }
  /// Null if only the forward direction is asked for.
  Coverage* backward() const { return directions_.backward; }
  bool bounds_boundaries() const { return directions_.boundary_backward; }
  /// The bounds of boundaries; null where they are not asked for.
  const TriangleCertificate* boundary_forward() const { return directions_.boundary_forward; }
  Coverage* boundary_backward() const { return directions_.boundary_backward; }

  /// An upper bound on the distance of a vertex, and the triangle that it was measured to.
  using PointBound = TriangleCertificate::PointBound;
  const PointBound& vertex_bound(std::uint32_t vertex) const { return vertices_[vertex]; }
  const FaceBound& face_bound(std::uint32_t triangle) const { return faces_[triangle]; }
  /// Notes such a bound, which was proved for the vertex or the face as it is.
  void note(std::uint32_t vertex, const PointBound& bound) { vertices_[vertex] = bound; }
  void note_face(std::uint32_t triangle, const FaceBound& bound) { faces_[triangle] = bound; }

  const FaceRule& rule(std::uint32_t triangle) const { return rules_[triangle]; }
  void set_rule(std::uint32_t triangle, const FaceRule& rule) { rules_[triangle] = rule; }
  /// Whether there is a rule of facing that the face is not free of.
  bool must_face(std::uint32_t triangle) const {
    return directions_.facing && rules_[triangle].limit < std::numbers::pi;
  }
  /// Starts the rule of a face with these corners in `facing`, which stays empty where the face does not have to keep
  /// it. Returns false if the face would have to, but has no sure normal.
  bool start(std::uint32_t triangle, const glm::dvec3 (&corners)[3], std::optional<Facing>& facing) const;

  /// How prove() searches: it may prefer to leave room below the limit for the faces to come, or search longer so that
  /// the result does not depend on the order of the corners.
  enum class Search { with_room, in_any_order };
  /// Returns what can be proved of a face with these corners, of which `known` is known, below `share` of the limit. A
  /// search in any order that finds no proof sets `open`, if it is not null, to a point of the face that it leaves
  /// open.
  FaceBound prove(std::uint32_t triangle, const glm::dvec3 (&corners)[3], const PointBound (&known)[3], double share,
                  Search search, glm::dvec3* open = nullptr) const;

  /// What is known of some vertices and faces, to go back to when the mesh does.
  struct Saved {
    std::vector<PointBound> vertices;
    std::vector<FaceBound> faces;
  };
  Saved save(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces) const;
  /// Goes back to it. `vertices` and `faces` are those that were saved.
  void restore(const Saved& saved, std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces);

 private:
  class VertexTrial;
  class FullTrial;

  const Directions directions_;
  std::vector<PointBound> vertices_;
  std::vector<FaceBound> faces_;
  std::vector<FaceRule> rules_;  ///< For each face; empty without a rule of facing.
};

}  // namespace tolvol
