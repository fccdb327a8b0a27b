// SPDX-License-Identifier: GPL-3.0-or-later
/// Maps coordinates as they are stored (float32 or float64, local, with a 4x4 matrix) to the frame in which everything
/// is decided, and back. The frame is the world, centred on the reference and scaled by a power of two to a size of
/// about 1, so that neither a far origin nor a tiny or huge scale costs accuracy.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace tolvol {

/// The unit roundoff of double precision.
inline constexpr double kUnitRoundoff = 0x1p-53;

class Frame {
 public:
  Frame() = default;
  /// The frame is centred on a box of the world. A power of two, which is exact, scales the half diagonal of the box
  /// into (1/2, 1]. For a box that is a point the scale is 1.
  explicit Frame(const Box& world);

  glm::dvec3 from_world(const glm::dvec3& p) const { return (p - centre_) * scale_; }
  glm::dvec3 to_world(const glm::dvec3& p) const { return p / scale_ + centre_; }
  /// The frame length of a world length of 1.
  double scale() const { return scale_; }
  /// The centre in the world.
  const glm::dvec3& centre() const { return centre_; }

 private:
  glm::dvec3 centre_{0};
  double scale_ = 1;
};

enum class Storage { float32, float64 };

/// Returns the float32 nearest to x. A plain cast there and back is not enough: GCC 12 drops the two casts when it
/// vectorises a loop or a constructor of several numbers.
double rounded_to_float32(double x);
glm::dvec3 rounded_to_float32(const glm::dvec3& p);

/// The space in which one array of vertices is stored, and its place in the world and in a frame.
class StoredSpace {
 public:
  /// Throws InvalidInput unless `to_world` is finite, affine and invertible.
  StoredSpace(const glm::dmat4& to_world, Storage storage, const Frame& frame = {});

  /// Returns the same space with another frame.
  StoredSpace in(const Frame& frame) const;

  glm::dvec3 world(const glm::dvec3& stored) const;
  /// Loses no accuracy to a far origin, neither of the local space nor of the world.
  glm::dvec3 frame(const glm::dvec3& stored) const {
    return (glm::dmat3(to_world_) * (stored - anchor_) + anchor_offset_) * frame_.scale();
  }
  std::vector<glm::dvec3> frame(std::span<const glm::dvec3> stored) const;

  /// Returns the stored value nearest to a position in the frame, rounded to the stored type. frame() of this value is
  /// the position to judge.
  glm::dvec3 store(const glm::dvec3& in_frame) const;

  /// Returns a bound, in frame lengths, on the difference between frame() and exact arithmetic over the bounding box of
  /// the given points.
  double mapping_error(std::span<const glm::dvec3> stored) const;
  /// The same over the given points and all that are stored for positions in the frame with coordinates up to `reach`.
  double mapping_error(std::span<const glm::dvec3> stored, double reach) const;
  /// Returns a bound, in frame lengths, on the motion by store() of a point whose stored coordinates are no larger than
  /// those of the given points.
  double storage_step(std::span<const glm::dvec3> stored) const;

  /// Tells whether `to_world` turns the front of faces to the back.
  bool mirrors() const { return mirrors_; }
  const glm::dmat4& to_world() const { return to_world_; }
  Storage storage() const { return storage_; }
  /// Returns half the distance from 1 to the next number that can be stored.
  double unit_roundoff() const { return storage_ == Storage::float32 ? 0x1p-24 : kUnitRoundoff; }

 private:
  void set_anchor();

  glm::dmat4 to_world_;
  glm::dmat3 to_local_;  ///< The inverse of the linear part of `to_world_`.
  Storage storage_;
  bool mirrors_;
  Frame frame_;
  glm::dvec3 anchor_{0};         ///< The stored position of the frame's centre, rounded.
  glm::dvec3 anchor_offset_{0};  ///< From the frame's centre to the anchor in the world, rounded only once.
  double anchor_error_ = 0;      ///< How far a coordinate of the offset may be off before it was rounded.
};

/// A position as it is stored, and the same position in the frame, which is mapped from the stored one.
struct VertexPosition {
  glm::dvec3 stored, position;

  /// Whether the stored type can hold it.
  bool is_finite() const { return std::isfinite(glm::dot(position, glm::dvec3(1))); }
};

/// Returns the length that 100 % stands for, in world units: the longest of the four diagonals of the local bounding
/// box of the used vertices, after `to_world`. Throws InvalidInput if all these vertices are at one point.
double longest_diagonal(std::span<const glm::dvec3> stored, std::span<const glm::uvec3> triangles,
                        const glm::dmat4& to_world);

}  // namespace tolvol
