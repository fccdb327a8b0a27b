// SPDX-License-Identifier: GPL-3.0-or-later
// If no corner goes farther than s, no edge vector changes by more than 2 s. With p and q for two edges and n for their
// cross product, n changes by at most 2 s (|p| + |q|) + 4 s^2. While this is at most x |n|, x < 1, the normal turns by
// at most asin(x). Solved for s: s = x |n| / (P + sqrt(P^2 + 4 x |n|)), P = |p| + |q|.
#include "motion/moving_facing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace tolvol {
namespace {

/// A share of the room that is left to rounding.
constexpr double kSafe = 1 - 0x1p-10;
/// No room is asked for a larger turn: its sine is about 0.88.
constexpr double kLargestTurn = 1.1;

}  // namespace

MovingFacing::MovingFacing(FacingRule rule, std::size_t faces, int corners)
    : rule_(std::move(rule)),
      count_(triangles_of(corners).size()),
      rules_(count_ * faces),
      anchors_(count_ * faces),
      trial_(count_ * faces),
      room_(faces, 0),
      trial_room_(faces, 0),
      is_renewed_(faces, 0) {}

void MovingFacing::reverse_reference(const std::vector<bool>& reversed, const Hierarchy& hierarchy, Team& team) {
  rule_.turn(reversed, hierarchy, team);
}

/// How far all corners may go before the triangle turns by `angle`.
double MovingFacing::room_to_turn(const glm::dvec3 (&corners)[3], double angle) const {
  const glm::dvec3 p = corners[1] - corners[0], q = corners[2] - corners[0], r = corners[2] - corners[1];
  const double lengths[3] = {glm::length(p), glm::length(q), glm::length(r)};
  const double edges = lengths[0] + lengths[1] + lengths[2] - std::max({lengths[0], lengths[1], lengths[2]});
  const double turn = std::clamp(angle, 0.0, kLargestTurn), sine = turn - turn * turn * turn / 6;
  const double change = sine * glm::length(glm::cross(p, q));
  if (!(change > 0)) return 0;
  // Rounding may have moved the corners here and there.
  const double room = kSafe * change / (edges + std::sqrt(edges * edges + 4 * change)) - 4 * rule_.mesh_error;
  return std::max(room, 0.0);
}

void MovingFacing::follow(std::uint32_t face, std::size_t triangle, const glm::dvec3 (&corners)[3],
                          double& room) const {
  const double limit = of(face, triangle).limit;
  if (limit >= std::numbers::pi || room < 0) return;
  std::optional<Facing> facing;
  if (!start(face, triangle, corners, facing)) {
    room = -1;
  } else if (!facing) {
    room = 0;
  } else {
    const Anchor& anchor = anchors_[count_ * face + triangle];
    const double angle = anchor.angle + angle_bound(glm::dot(anchor.normal, facing->normal()));
    // The comparison is written so that NaN leaves no room.
    room = angle <= limit ? std::min(room, room_to_turn(corners, limit - angle)) : -1;
  }
}

void MovingFacing::renew(std::uint32_t face, std::size_t triangle, const glm::dvec3 (&corners)[3],
                         const std::optional<Facing>& facing, Known& known) const {
  known.is_renewed = true;
  known.anchors[triangle] = facing ? Anchor{facing->normal(), facing->angle()} : Anchor{};
  const double limit = of(face, triangle).limit;
  if (limit >= std::numbers::pi) return;
  known.room = std::min(known.room, facing ? room_to_turn(corners, limit - facing->angle()) : 0);
}

void MovingFacing::start_own(std::uint32_t face, std::size_t triangle, const glm::dvec3 (&corners)[3],
                             const std::optional<glm::dvec3>& normal) {
  if (!normal) return;
  const FaceRule& rule = of(face, triangle);
  const double angle = std::min(angle_bound(1), rule.limit);
  anchors_[count_ * face + triangle] = {rule.reversed ? -*normal : *normal, angle};
  room_[face] = room_to_turn(corners, rule.limit - angle);
}

void MovingFacing::set_trial(std::uint32_t face, const Known& known) {
  trial_room_[face] = known.room;
  is_renewed_[face] = known.is_renewed;
  if (known.is_renewed) std::copy_n(known.anchors.begin(), count_, trial_.begin() + count_ * face);
}

void MovingFacing::accept(std::uint32_t face) {
  room_[face] = trial_room_[face];
  if (is_renewed_[face]) std::copy_n(trial_.begin() + count_ * face, count_, anchors_.begin() + count_ * face);
}

std::optional<double> MovingFacing::angle(std::uint32_t face, std::size_t triangle,
                                          const glm::dvec3 (&corners)[3]) const {
  if (of(face, triangle).limit >= std::numbers::pi) return std::numbers::pi;
  std::optional<Facing> facing;
  start(face, triangle, corners, facing);
  if (!facing) return std::nullopt;
  const Anchor& anchor = anchors_[count_ * face + triangle];
  return std::min(anchor.angle + angle_bound(glm::dot(anchor.normal, facing->normal())), of(face, triangle).limit);
}

}  // namespace tolvol
