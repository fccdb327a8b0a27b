// SPDX-License-Identifier: GPL-3.0-or-later
/// The promise that no face of a moving mesh is turned away from the reference: every point of a face has a witness
/// within the tolerance whose normal is within an angle of the face's (check/facing.h).
///
/// A face that moves with its witnesses keeps them as long as it does not turn too far. Each triangle of a face has its
/// anchor for this: the normal that it had when its witnesses were found, and their largest angle then.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "check/facing.h"
#include "check/tolerance_check.h"

namespace tolvol {

/// It holds what is known of the faces of the state, and beside it of those on trial.
class MovingFacing {
 public:
  /// A face has at most this many triangles: a quad has four, two in each of its triangulations.
  static constexpr std::size_t kMost = 4;

  struct Anchor {
    glm::dvec3 normal{std::numeric_limits<double>::quiet_NaN()};  ///< is NaN if no angle was found, as the angle is
    double angle = std::numeric_limits<double>::quiet_NaN();
  };
  /// What is known of a face in one position.
  struct Known {
    /// The face cannot exceed its angle until a corner has gone this far. This is less than 0 if it may exceed the
    /// angle already.
    double room = std::numeric_limits<double>::infinity();
    bool is_renewed = false;  ///< Whether there are new anchors.
    std::array<Anchor, kMost> anchors;
  };

  /// Each face has `corners` vertices, 3 or 4.
  MovingFacing(FacingRule rule, std::size_t faces, int corners);

  const FacingRule& rule() const { return rule_; }
  /// Turns the normals of these triangles of the reference, whose hierarchy this is.
  void reverse_reference(const std::vector<bool>& reversed, const Hierarchy& hierarchy, Team& team);
  FaceRule& of(std::uint32_t face, std::size_t triangle) { return rules_[count_ * face + triangle]; }
  const FaceRule& of(std::uint32_t face, std::size_t triangle) const { return rules_[count_ * face + triangle]; }

  /// How far the corners of the face may go from the state before it could exceed its angle.
  double room(std::uint32_t face) const { return room_[face]; }
  /// Starts the rule of a triangle with these corners, as start_facing() does.
  bool start(std::uint32_t face, std::size_t triangle, const glm::dvec3 (&corners)[3],
             std::optional<Facing>& facing) const {
    return start_facing(rule_, of(face, triangle), corners, facing);
  }
  /// Takes a triangle of a face into account that has gone to these corners together with its witnesses.
  void follow(std::uint32_t face, std::size_t triangle, const glm::dvec3 (&corners)[3], double& room) const;
  /// Takes a triangle into account whose witnesses were found anew. `facing` has their angle; none if it has no angle.
  void renew(std::uint32_t face, std::size_t triangle, const glm::dvec3 (&corners)[3],
             const std::optional<Facing>& facing, Known& known) const;

  /// Makes the triangle, which has this sure normal or none, its own witness in the state.
  void start_own(std::uint32_t face, std::size_t triangle, const glm::dvec3 (&corners)[3],
                 const std::optional<glm::dvec3>& normal);

  /// Sets what is known of a face on trial, and makes that the state.
  void set_trial(std::uint32_t face, const Known& known);
  void accept(std::uint32_t face);

  /// An upper bound on the angle between a triangle with these corners, which are those of the state, and its
  /// witnesses. None if it has no sure normal, and pi if it is free of the rule.
  std::optional<double> angle(std::uint32_t face, std::size_t triangle, const glm::dvec3 (&corners)[3]) const;

 private:
  double room_to_turn(const glm::dvec3 (&corners)[3], double angle) const;

  FacingRule rule_;
  std::size_t count_;            // The number of triangles of a face.
  std::vector<FaceRule> rules_;  // For each triangle of each face, as the anchors are.
  std::vector<Anchor> anchors_, trial_;
  std::vector<double> room_, trial_room_;  // For each face.
  std::vector<std::uint8_t> is_renewed_;   // For each face on trial; threads would share bits.
};

}  // namespace tolvol
