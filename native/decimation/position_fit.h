// SPDX-License-Identifier: GPL-3.0-or-later
/// Finds the place where the moving vertex of a change would be best: all faces around it near the reference, and the
/// reference near to them. The largest deviations count most. It steers a search and proves nothing.
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

  /// Takes some of the pieces of the reference that the faces of a prepared change have to cover. They serve for any
  /// position.
  void gather(const Change& change);

  struct Fit {
    double energy;  ///< The sum of areas, weighted by a high power of deviation over tolerance.
    /// The largest deviation that was seen, over the tolerance; from a face over the root of the face's share, too.
    /// Both are of the given position.
    double deviation;
    glm::dvec3 position;  ///< A position that lowers the energy, to first order.
  };
  /// The fit of the faces as the change would leave them, with its vertex at `position`. About 10 ns for each face and
  /// piece. Where the deviation is beyond `most`, only that is found.
  Fit fit(const Change& change, const glm::dvec3& position, double most = std::numeric_limits<double>::infinity());
  /// Tries a collapse at fitted positions: it takes a step from `start` for each of the limits, until the collapse is
  /// possible. It is refused where the deviation before a step, over the tolerance, is beyond the step's limit.
  ChangeTrial::Outcome collapse(ChangeTrial& trial, Change::Halfedge h, const glm::dvec3& start,
                                std::span<const double> give_up_above);

  /// Starts to count anew.
  void begin() { looked_at_ = 0; }
  /// The number of points for which the nearest point was looked for since begin().
  std::size_t looked_at() const { return looked_at_; }

 private:
  struct Sums;
  void prepare(const Change& change);
  void add_pieces(const Change& change, double most, Sums& sums);
  void add_faces(const Change& change, double most, Sums& sums);

  const BoundedMesh* mesh_;
  const CertifiedBounds* bounds_;
  std::vector<Coverage::Sample> samples_;
  std::vector<WitnessTriangle> faces_;
  std::size_t looked_at_ = 0;
};

}  // namespace tolvol
