// SPDX-License-Identifier: GPL-3.0-or-later
/// Tries to collapse an edge and to move the vertices and flip the edges around it so that the bounds are kept. A
/// Relaxation proposes the positions; the certificates of both directions and the test of crossings decide about all
/// that has changed at once. A trial only reads the mesh until carry_out(), and holds all that it needs.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "check/coverage.h"
#include "decimation/bounded_mesh.h"
#include "decimation/certified_bounds.h"
#include "decimation/change.h"
#include "decimation/refinement/patch.h"
#include "decimation/refinement/patch_deviations.h"
#include "decimation/refinement/relaxation.h"
#include "decimation/refinement/surface_samples.h"
#include "decimation/surroundings.h"

namespace tolvol {

class PatchTrial {
 public:
  using Halfedge = BoundedMesh::Halfedge;

  /// Keeps references to `mesh`, whose bounds are certified, to `samples`, and to `around`, which is null where
  /// crossings are allowed.
  PatchTrial(const BoundedMesh& mesh, const SurfaceSamples& samples, Surroundings* around);

  /// What a collapse would cost if its vertex alone moved.
  struct Price {
    double rise = 0;     ///< The rise of the energy of PatchDeviations.
    double largest = 0;  ///< The largest deviation, over the tolerance.
    Halfedge halfedge;   ///< The start merges into the end.
    glm::dvec3 position{0};
  };
  /// The least of the prices of an edge; none where it cannot collapse. About 0.1 ms.
  std::optional<Price> price(BoundedMesh::Edge edge);

  /// How much a try may take.
  struct Effort {
    int rings;         ///< The vertices that are less than so many edges away from the collapse move as well.
    bool many_starts;  ///< Whether a near miss is tried again with an edge near by flipped first, each edge in turn.
                       ///< The relaxation may come to another minimum from there.
    bool quick;        ///< Whether it gives up earlier after a refusal, and misses about one success in thirty. From
                       ///< starts after the first it always does.
  };
  /// Whether an edge can collapse.
  bool try_collapse(const Price& price, const Effort& effort);
  /// Carries out what was found possible. Returns a box of stored positions around all that it changes, which is empty
  /// where crossings were not looked for.
  Box carry_out(BoundedMesh& mesh);

  /// The largest deviation, over the tolerance, that the last try came to from its first start; infinite if it had
  /// none.
  double reached() const { return reached_; }
  /// The number of searches of the last try (PatchDeviations::work()): the same for each number of threads.
  std::size_t work() const { return work_; }
  /// The patch of the last try.
  const Patch& patch() const { return patch_; }
  /// The vertex that the last try would remove, and the faces.
  std::uint32_t vanished() const { return vanished_; }
  std::span<const Coverage::Removed> removed() const { return removed_; }
  /// What the last try found of crossings depends on no face outside this box of stored positions.
  const Box& read() const { return crossings_.crossings.read(); }
  /// Whether a start of the last try was refused because another vertex is where one of its vertices would be.
  bool met_another() const { return met_another_; }

 private:
  bool prepare(Halfedge h, const glm::dvec3& position, int rings);
  bool relax_and_certify(double worth_going_on, bool quick);
  bool relax(double worth_going_on);
  bool certify();
  void round_positions();
  bool leaves_cell() const;
  bool meets_another();
  bool changed(std::uint32_t face) const;
  bool pieces_hold();
  bool faces_hold();
  FaceBound prove(std::uint32_t face, glm::dvec3& open) const;
  bool boundary_holds();
  bool uncrossed();
  bool keep_sheets_apart();
  void gather_elements();
  bool add_face_points(std::uint32_t face);
  void add_open_point(std::uint32_t face, const glm::dvec3& open);

  const BoundedMesh& mesh_;
  CertifiedBounds& bounds_;
  const SurfaceSamples& samples_;
  Surroundings* around_;
  Change change_;
  Patch patch_;
  PatchDeviations deviations_;
  Relaxation relaxation_;
  std::uint32_t vanished_ = 0;
  double reached_ = 0;
  std::size_t work_ = 0;
  std::vector<VertexPosition> positions_;  ///< For each vertex of the patch.
  std::vector<bool> moved_;                ///< For each vertex of the patch: whether it leaves its place in the mesh.
  std::vector<CertifiedBounds::PointBound> vertex_bounds_;
  std::vector<FaceBound> face_bounds_;
  std::vector<Coverage::Element> elements_, boundary_elements_;
  std::vector<Coverage::Removed> removed_, boundary_removed_;
  Coverage::Trial backward_, boundary_backward_;
  Surroundings::Trial crossings_;
  bool learnt_ = false;  ///< Whether a refusal has named points that the relaxation did not see.
  bool met_another_ = false;
};

}  // namespace tolvol
