// SPDX-License-Identifier: GPL-3.0-or-later
/// All points within the tolerance of a reference: the reference in its frame, and what makes asking fast.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "check/witness.h"
#include "field/distance_grid.h"
#include "geometry/frame.h"
#include "geometry/hierarchy.h"

namespace tolvol {

/// The share of the tolerance that operations leave unused, so that an independent measure, with rounding of its own,
/// proves a result in finite time. Costs no triangles to speak of.
inline constexpr double kHeadroom = 1e-4;

/// What fills the distance grid: field/scatter.h (exact), or field/fast_marching.h (the paper's way, for comparison).
enum class Field { scatter, fast_marching };

class ToleranceVolume {
 public:
  struct Options {
    std::optional<double> precision;  ///< grid nodes per tolerance; empty: the finest that fits kGridBudget
    unsigned threads = 0;             ///< 0: one per core
    Progress* progress = nullptr;
    Field field = Field::scatter;  ///< never changes a verdict's truth
  };

  /// `tolerance` in world units. Throws InvalidInput for a bad mesh or for a tolerance that is not finite and positive,
  /// that is larger than the reference, or that double precision cannot hold at this distance from the origin;
  /// ResourceLimit for a precision whose grid does not fit. O(m log m + nodes in the band).
  ToleranceVolume(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
                  double tolerance, const Options& options);
  ToleranceVolume(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
                  double tolerance)
      : ToleranceVolume(vertices, triangles, space, tolerance, Options()) {}

  ToleranceVolume(const ToleranceVolume&) = delete;
  ToleranceVolume& operator=(const ToleranceVolume&) = delete;

  const Frame& frame() const { return frame_; }
  const TriangleMesh& reference() const { return reference_; }                  ///< in the frame, every input vertex
  const std::vector<WitnessTriangle>& witnesses() const { return witnesses_; }  ///< of the reference, prepared
  const Hierarchy& hierarchy() const { return *hierarchy_; }
  const DistanceGrid& grid() const { return grid_; }
  bool mirrored() const { return mirrored_; }  ///< the reference's triangles run the other way round
  /// field/signs.h: the grid's distances, negative inside the reference as it is in the world, mirrored or not.
  std::vector<float> signed_distance() const;

  double tolerance() const { return tolerance_; }  ///< world units
  double frame_tolerance() const { return tolerance_ * frame_.scale(); }
  double diagonal() const { return diagonal_; }  ///< longest_diagonal() of the reference: world units, what 100 % means
  Field field() const { return field_; }
  double precision() const { return frame_tolerance() / grid_.spacing; }
  std::size_t memory() const;  ///< bytes held

  /// The distance, in the frame, up to which a witness found in floating point proves a piece inside: the tolerance
  /// less all that rounding may hide, of the witness arithmetic and of mapping both sides into the frame. Throws
  /// InvalidInput when less than half of the tolerance is left.
  double provable(double mapping_error) const;
  /// The distance beyond which a computed one proves a point outside.
  double refutable(double mapping_error) const { return 2 * frame_tolerance() - provable(mapping_error); }

 private:
  Frame frame_;
  TriangleMesh reference_;
  std::vector<WitnessTriangle> witnesses_;
  std::optional<Hierarchy> hierarchy_;
  DistanceGrid grid_;
  double tolerance_;
  double diagonal_;
  double mapping_error_;
  Field field_;
  bool mirrored_;
};

}  // namespace tolvol
