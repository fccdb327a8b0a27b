// SPDX-License-Identifier: GPL-3.0-or-later
/// Where the moving vertex of a change would be best: near the reference with all faces around it, and the reference
/// near to them, the largest deviations counting most. It steers a search and proves nothing.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "decimation/certified_bounds.h"
#include "decimation/change_trial.h"

namespace tolvol {

class PositionFit {
 public:
  /// Keeps references to `mesh` and its bounds, which are certified if anything is asked.
  explicit PositionFit(const BoundedMesh& mesh) : mesh_(&mesh), bounds_(mesh.certified()) {}

  /// Takes some of the pieces of the reference that the faces of a prepared change have to cover; good for any
  /// position, and for the faces as they are now.
  void gather(const Change& change);

  struct Fit {
    double energy;        ///< areas weighted by a high power of deviation over tolerance
    double deviation;     ///< the largest of those looked at, over the tolerance; like the energy of where it was asked
    glm::dvec3 position;  ///< lowers it, to first order
  };
  /// Of the faces as the change would leave them, its vertex at `position`. About 10 ns a face and piece. Where the
  /// deviation is beyond `hopeless`, that is all that is found.
  Fit fit(const Change& change, const glm::dvec3& position, double hopeless = std::numeric_limits<double>::infinity());
  /// Tries a collapse at fitted positions: from `start` a step for each of the limits,
  /// until it is possible. With a deviation beyond the step's limit before it, over the tolerance, it is refused.
  ChangeTrial::Outcome collapse(ChangeTrial& trial, Change::Halfedge h, const glm::dvec3& start,
                                std::span<const double> give_up_above);
  /// Energy of the same faces as they are.
  double energy_now(const Change& change);

 private:
  struct Sums;
  void prepare(const Change& change, bool changed);
  void add_pieces(const Change& change, double hopeless, Sums& sums) const;
  void add_faces(const Change& change, double hopeless, Sums& sums) const;

  const BoundedMesh* mesh_;
  const CertifiedBounds* bounds_;
  std::vector<Coverage::Sample> samples_;
  std::vector<WitnessTriangle> faces_;
};

}  // namespace tolvol
