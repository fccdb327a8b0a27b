// SPDX-License-Identifier: GPL-3.0-or-later
/// Bounds that are proved: every point of the mesh is within the tolerance of the reference; if asked for, every point
/// of the reference is within it of the mesh, and the boundaries are within it of each other. The class keeps account
/// of what is known of every vertex and face, in the volume's frame.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "check/certificate.h"
#include "check/coverage.h"
#include "decimation/bounds.h"

namespace tolvol {

class CertifiedBounds final : public Bounds {
 public:
  /// The checks of each direction; a null pointer is a promise that is not asked for.
  struct Directions {
    const TriangleCertificate& forward;
    Coverage* backward = nullptr;                           ///< Its elements are triangles of the mesh.
    const TriangleCertificate* boundary_forward = nullptr;  ///< It is about the reference's boundary edges.
    Coverage* boundary_backward = nullptr;  ///< Its elements are boundary edges, named by their first vertex.
  };
  /// Makes the bounds for a mesh with vertices at these positions, before any change. `on_reference` says that every
  /// triangle is one of the reference. Keeps references to the checks.
  CertifiedBounds(const Directions& directions, std::span<const glm::dvec3> positions, std::size_t triangle_count,
                  bool on_reference);

  std::unique_ptr<Trial> trial() override;
  /// A trial that asks only where the vertex is: a DeferredProof has to prove the rest.
  std::unique_ptr<Trial> trial_on_trust();
  CertifiedBounds* certified() override { return this; }

  const TriangleCertificate& forward() const { return directions_.forward; }
  /// Null if only the forward direction is asked for.
  Coverage* backward() const { return directions_.backward; }
  bool bounds_boundaries() const { return directions_.boundary_backward; }
  /// The bounds of boundaries; null where they are not asked for.
  const TriangleCertificate* boundary_forward() const { return directions_.boundary_forward; }
  Coverage* boundary_backward() const { return directions_.boundary_backward; }

  /// Upper bounds on the distance to the reference: of a vertex, and of all points of a face (infinite where no bound
  /// is known).
  double distance(std::uint32_t vertex) const { return distance_[vertex]; }
  double face_distance(std::uint32_t triangle) const { return face_distance_[triangle]; }
  /// Notes such a bound, which was proved for the vertex or the face as it is.
  void note_distance(std::uint32_t vertex, double distance) { distance_[vertex] = distance; }
  void note_face_distance(std::uint32_t triangle, double distance) { face_distance_[triangle] = distance; }

  /// What is known of some vertices and faces, to go back to when the mesh does.
  struct Saved {
    std::vector<double> distance, face_distance;
  };
  Saved save(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces) const;
  /// Goes back to it. `vertices` and `faces` are those that were saved.
  void restore(const Saved& saved, std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces);

 private:
  class VertexTrial;
  class FullTrial;

  const Directions directions_;
  std::vector<double> distance_, face_distance_;
};

}  // namespace tolvol
