// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether a face and its witnesses face the same way. Distances alone do not tell: a face that is turned over is
/// within the tolerance of the surface that it was made from, and may have the other side of a thin wall as its
/// witness.
///
/// All angles are between the fronts of triangles, in radians. A normal is used only where rounding cannot turn it by
/// more than kSureNormal. A triangle without such a normal, degenerate or nearly so, is no witness.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "geometry/hierarchy.h"
#include "geometry/rounded_box.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class Team;  // base/parallel.h

/// The sine of the angle by which a normal that is used may be wrong.
inline constexpr double kSureNormal = 0x1p-24;

/// Returns the unit normal of a triangle if it is sure. Each corner may be wrong by `error`; coordinates are in a
/// frame.
std::optional<glm::dvec3> sure_normal(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, double error);

/// Returns an upper bound on the exact angle between two triangles whose sure normals have this dot product. It is less
/// than 1e-6 too large near 0, and 0.02 at most. It uses square roots alone, so that every platform gets one result.
double angle_bound(double cosine);

/// The rule that the normal of every witness is within an angle of the face's normal.
struct FacingRule {
  /// `angle` is the largest angle that the rule permits, more than 0 and less than pi. Rounding may have moved the
  /// corners of the reference's triangles by `reference_error`, and those of faces by `mesh_error`. O(m), shared by the
  /// threads of the team.
  FacingRule(const TriangleMesh& reference, double reference_error, double mesh_error, double angle, Team& team);

  /// Bounds the normals below each node of the reference's hierarchy, so that nearest() leaves out nodes in which no
  /// triangle faces as it should. A normal that becomes NaN later only leaves the bounds wider than they need be. O(m),
  /// shared by the threads of the team.
  void bound_normals(const Hierarchy& hierarchy, Team& team);
  /// Turns the normals of these triangles, and bounds the normals anew if there are any. O(m).
  void turn(const std::vector<bool>& reversed, const Hierarchy& hierarchy, Team& team);

  /// Tells of a triangle whether a search may end with it.
  using Enough = std::function<bool(std::uint32_t triangle)>;

  /// Returns the nearest triangle within `radius` of p whose normal has at least `least` as its dot product with
  /// `normal`. `hierarchy` is the reference's, and `hint` a triangle that is tried first, or kNone. With `enough` it
  /// may return another such triangle for which that holds.
  Hierarchy::Nearest nearest(const Hierarchy& hierarchy, const glm::dvec3& p, const glm::dvec3& normal, double least,
                             double radius, std::uint32_t hint = Hierarchy::kNone, const Enough& enough = {}) const;

  /// Tells whether a triangle below a node of the hierarchy may have at least `least` as the dot product of its normal
  /// with `normal`, which is at most as long as a unit vector.
  bool may_face(std::uint32_t node, const glm::dvec3& normal, double least) const;

  std::vector<glm::dvec3> normals;  ///< are those of the reference's triangles; NaN, which admits none, if not sure
  std::size_t unsure = 0;           ///< counts the triangles with an area but without a sure normal
  double mesh_error;
  double angle;
  double least_cosine;  ///< is that of two sure normals between which the angle is at most `angle`

 private:
  std::vector<RoundedBox> below_;  ///< holds the sure normals below each node; empty before bound_normals()
};

/// Given as the least dot product with a normal, this admits every product above 0.
inline constexpr double kSameSide = std::numeric_limits<double>::denorm_min();

/// How one face keeps the rule, for as long as there is the face.
struct FaceRule {
  double limit = std::numbers::pi;  ///< is the largest angle; pi for a face that is free of the rule
  bool reversed = false;            ///< tells whether the other side of the face has to face as its witnesses do
  bool may_be_unsure = false;       ///< tells whether the face may have no sure normal, because its input face had none
};

/// The rule for one face, and what a search has found of it.
class Facing {
 public:
  /// `normal` is the sure normal of the face, and `limit` the largest angle between it and that of a witness. Keeps a
  /// reference to the rule.
  Facing(const FacingRule& rule, const glm::dvec3& normal, double limit);

  /// Sets the triangles of the reference from which the bounds of the corners were measured. Unless all are admitted,
  /// these bounds prove nothing of the face.
  void set_corners(const glm::uvec3& triangles) { corners_ = triangles; }
  /// Takes the triangles of the corners as witnesses, if all are admitted.
  bool take_corners() {
    for (int k = 0; k < 3; ++k) {
      if (corners_[k] == kNone || !admits(corners_[k])) return false;
    }
    for (int k = 0; k < 3; ++k) take(corners_[k]);
    return true;
  }

  const glm::dvec3& normal() const { return normal_; }
  double limit() const { return limit_; }

  /// Starts a search.
  void begin() { least_ = 1; }
  /// Tells whether a triangle of the reference may be a witness.
  bool admits(std::uint32_t triangle) const { return cosine(triangle) >= least_cosine_; }
  /// Tells whether a triangle below a node of the reference's hierarchy may be admitted.
  bool may_admit(std::uint32_t node) const { return rule_->may_face(node, normal_, least_cosine_); }
  /// Returns the nearest triangle within `radius` of p that is admitted, or one for which `enough` holds. `hierarchy`
  /// is the reference's.
  Hierarchy::Nearest nearest(const Hierarchy& hierarchy, const glm::dvec3& p, double radius, std::uint32_t hint = kNone,
                             const FacingRule::Enough& enough = {}) const {
    return rule_->nearest(hierarchy, p, normal_, least_cosine_, radius, hint, enough);
  }
  /// Notes that an admitted triangle is a witness.
  void take(std::uint32_t triangle) { least_ = std::min(least_, cosine(triangle)); }
  /// Returns an upper bound on the angle between the face and any witness noted since begin().
  double angle() const { return std::min(angle_bound(least_), limit_); }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  double cosine(std::uint32_t triangle) const { return glm::dot(rule_->normals[triangle], normal_); }

  const FacingRule* rule_;
  glm::dvec3 normal_;
  glm::uvec3 corners_{kNone};
  double limit_, least_cosine_, least_ = 1;
};

/// How the faces of a result face the reference.
struct Normals {
  /// An upper bound, in degrees, on the angle of all faces but those below; none if no face has an angle.
  std::optional<double> largest;
  std::size_t unsure = 0;           ///< The number of faces without an angle, because rounding could turn them.
  std::size_t exceeded_before = 0;  ///< The number of input faces with no proof of the angle that is kept.
  std::size_t exceeded_after = 0;   ///< How many of them are left so.
};

/// Starts the rule of a face with these corners in `facing`, which stays empty where the face need not keep it. Returns
/// false if the face would have to, but has no sure normal.
bool start_facing(const FacingRule& rule, const FaceRule& of_face, const glm::dvec3 (&corners)[3],
                  std::optional<Facing>& facing);

/// Returns the limit of a face for which `angle` was not proved: the least angle that can be proved, to within a
/// degree, or pi if hardly less than a half turn can. `prove` returns the angle that it finds within a limit, or none.
double least_limit(double angle, const std::function<std::optional<double>(double limit)>& prove);

}  // namespace tolvol
