// SPDX-License-Identifier: GPL-3.0-or-later
/// Where the moving vertex of a change would be best: near the reference with all faces around it, and the reference
/// near to them, the largest deviations counting most. It steers a search and proves nothing.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "operation/change.h"

namespace tolvol {

class PositionFit {
 public:
  /// Every `stride`-th piece of the reference stands for the others. Keeps a reference to `mesh`, which needs a forward
  /// bound.
  PositionFit(const BoundedMesh& mesh, std::size_t stride) : mesh_(&mesh), stride_(stride) {}

  /// Takes the pieces of the reference that the faces of a prepared change have to cover; good for any position.
  void gather(const Change& change);

  struct Fit {
    double energy;        ///< of the faces as they are: areas weighted by a high power of deviation over tolerance
    glm::dvec3 position;  ///< that lowers it, to first order
  };
  /// For the change as it is prepared now. About 0.1 us a face and piece.
  Fit fit(const Change& change, const glm::dvec3& position) const;

 private:
  const BoundedMesh* mesh_;
  std::size_t stride_;
  std::vector<Coverage::Sample> samples_;
};

}  // namespace tolvol
