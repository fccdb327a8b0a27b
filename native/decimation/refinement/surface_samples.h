// SPDX-License-Identifier: GPL-3.0-or-later
/// Points of the reference that each face of a mesh is the witness of, spread evenly over what the face has to be near
/// to. They steer a Relaxation and prove nothing.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "check/coverage.h"
#include "decimation/bounded_mesh.h"

namespace tolvol {

/// A point of the reference that a face of the mesh has to be near to.
struct SurfaceSample {
  glm::dvec3 point;
  double weight;
  double deviation;    ///< Its deviation from the face now, over the tolerance.
  glm::dvec3 weights;  ///< The barycentric coordinates of the point of the face that is nearest to it.
};

class SurfaceSamples {
 public:
  /// Takes samples of all faces of the mesh, whose bounds are certified; none where only the forward direction is kept.
  SurfaceSamples(const BoundedMesh& mesh, Team& team);

  /// The samples of a face. Their weights are about 1 together.
  std::span<const SurfaceSample> of(std::uint32_t face) const { return samples_[face]; }

  /// The energy of the samples of a face: the sum of their weights times the eighth power of their distance from the
  /// face, over the tolerance.
  double energy(std::uint32_t face) const { return energy_[face]; }

  /// Takes the samples of a face anew, after its pieces of the reference have changed. About 0.2 ms.
  void renew(const BoundedMesh& mesh, std::uint32_t face);

 private:
  std::vector<std::vector<SurfaceSample>> samples_;
  std::vector<double> energy_;
};

}  // namespace tolvol
