// SPDX-License-Identifier: GPL-3.0-or-later
/// All points within the tolerance of a reference. It holds the reference in its frame, and a grid and a hierarchy that
/// make checks fast.
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

/// Operations leave this share of the tolerance unused, so that an independent measure, with rounding of its own,
/// proves a result in finite time. The share costs hardly any triangles.
inline constexpr double kHeadroom = 1e-4;

/// Says what fills the distance grid: field/scatter.h (exact), field/scatter_gl.h (the same on the GPU), or
/// field/fast_marching.h (the paper's way, for comparison).
enum class Field { scatter, gl, fast_marching };

class ToleranceVolume {
 public:
  struct Options {
    std::optional<double> precision;  ///< is in grid nodes per tolerance; if empty, the finest that fits `grid_memory`
    unsigned threads = 0;             ///< 0 means one for each core
    Progress* progress = nullptr;
    Field field = Field::scatter;           ///< never makes a verdict wrong
    std::size_t grid_memory = kGridBudget;  ///< is in bytes; less makes proofs slower and no verdict wrong
  };

  /// `tolerance` is in world units. Throws InvalidInput for a bad mesh, and for a tolerance that is not finite and
  /// positive, that is larger than the reference, or that double precision cannot hold at this distance from the
  /// origin. Throws ResourceLimit for a precision whose grid does not fit, and GlUnavailable for Field::gl without GL.
  /// O(m log m + nodes in the band).
  ToleranceVolume(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
                  double tolerance, const Options& options);
  ToleranceVolume(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles, const StoredSpace& space,
                  double tolerance)
      : ToleranceVolume(vertices, triangles, space, tolerance, Options()) {}

  ToleranceVolume(const ToleranceVolume&) = delete;
  ToleranceVolume& operator=(const ToleranceVolume&) = delete;

  const Frame& frame() const { return frame_; }
  const TriangleMesh& reference() const { return reference_; }   ///< has all input vertices
  Witnesses witnesses() const { return Witnesses(reference_); }  ///< are the reference's triangles
  const Hierarchy& hierarchy() const { return *hierarchy_; }
  const DistanceGrid& grid() const { return grid_; }
  bool mirrored() const { return mirrored_; }  ///< tells whether the space turns the front of triangles to the back
  /// Returns the grid's distances, negative inside the reference as it is in the world, mirrored or not
  /// (field/signs.h).
  std::vector<float> signed_distance() const;

  double tolerance() const { return tolerance_; }  ///< is in world units
  double frame_tolerance() const { return tolerance_ * frame_.scale(); }
  double diagonal() const { return diagonal_; }  ///< is the reference's longest_diagonal(), 100 %, in world units
  Field field() const { return field_; }
  double mapping_error() const { return mapping_error_; }  ///< is of the reference, see StoredSpace::mapping_error()
  double precision() const { return frame_tolerance() / grid_.spacing; }
  std::size_t memory() const;  ///< is in bytes

  /// Returns the distance, in the frame, up to which a witness found in floating point proves a piece inside. It is the
  /// tolerance less all rounding, of the witness arithmetic and of mapping both sides into the frame. Throws
  /// InvalidInput if it is not more than half of the tolerance.
  double provable(double mapping_error) const;
  /// Returns the distance, in the frame, beyond which a computed distance proves that a point is outside.
  double refutable(double mapping_error) const { return 2 * frame_tolerance() - provable(mapping_error); }

 private:
  void fill_grid(const Options& options);
  [[noreturn]] void refuse_tolerance() const;

  Frame frame_;
  TriangleMesh reference_;
  std::optional<Hierarchy> hierarchy_;
  DistanceGrid grid_;
  double tolerance_;
  double diagonal_;
  double mapping_error_;
  Field field_;
  bool mirrored_;
};

}  // namespace tolvol
