// SPDX-License-Identifier: GPL-3.0-or-later
// No point of a face is farther from the reference than before by more than the longest step of its corners: this
// settles almost all faces without a question to the reference. The witness certificate decides about the others.
#include "motion/moving_mesh.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/call.h"
#include "base/parallel.h"
#include "geometry/closest_point.h"
#include "geometry/lengths.h"
#include "motion/finite.h"
#include "motion/selection.h"

namespace tolvol {
namespace {

/// A share of the provable distance. The certificate proves a face that is nearer than it, because the parts that it
/// splits into become smaller than the rest of the distance. Therefore it need not be asked about such a face.
constexpr double kEasy = 0.98;
/// In provable distances: a longer face is settled by the certificate alone. So small parts along all of its length
/// could be more than the certificate looks at.
constexpr double kLongestEasy = 1000;
/// Distances are known up to this multiple of the provable distance.
constexpr double kKnown = 2;
/// A bound on the rounding of distances in the frame.
constexpr double kRoundingInFrame = 0x1p-44;
/// A bound on the relative rounding of a step's length, and of a sum with it.
constexpr double kRoundUp = 0x1p-50;
// A trial beyond this, in frame lengths, is here instead: the squares of its coordinates do not overflow, and it is as
// far outside.
constexpr double kFarthest = 0x1p500;

}  // namespace

std::vector<std::uint32_t> MovingMesh::faces_around(std::span<const std::uint32_t> vertices) {
  ++now_;
  std::vector<std::uint32_t> faces;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    poll_at(i + 1);  // A few vertices need no poll.
    for (const std::uint32_t f : ring(vertices[i])) {
      if (std::exchange(seen_[f], now_) != now_) faces.push_back(f);
    }
  }
  return faces;
}

MovingMesh::PointBound MovingMesh::bound_at(const glm::dvec3& at) const {
  const double box = 1 + 2 * volume_->frame_tolerance();
  // The comparison is written so that NaN is outside.
  if (!(std::abs(at.x) <= box && std::abs(at.y) <= box && std::abs(at.z) <= box)) return {kFar};
  const PointBound found = certificates_.front().nearest(at, kKnown * provable_);
  return found.triangle == Hierarchy::kNone ? PointBound{kFar} : found;
}

MovingMesh::PointBound MovingMesh::bound_at(std::uint32_t vertex, const glm::dvec3& at, Aim aim) {
  if (refusals_.empty()) return bound_at(at);
  std::array<Refusal, 2>& known = refusals_[vertex];
  for (const Refusal& r : known) {
    if (glm::length(at - r.at) < r.margin) return {kFar};
  }
  const PointBound found = bound_at(at);
  const double room = std::min(found.distance, kKnown * provable_) - provable_;
  if (room > 0) known[static_cast<std::size_t>(aim)] = {at, room - kRoundingInFrame};
  return found;
}

/// Whether the face is too long on trial to be settled without the certificate.
bool MovingMesh::is_too_long(std::uint32_t face) const {
  const double longest = kLongestEasy * limit_;
  // No face in the volume is longer than this.
  const double largest = (volume_->diagonal() + 2 * volume_->tolerance()) * volume_->frame().scale();
  if (longest > largest) return false;
  const std::span<const std::uint32_t> corners = corners_of(face);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (squared_length(trial_[corners[k]].at - trial_[corners[i]].at) > longest * longest) return true;
    }
  }
  return false;
}

MovingMesh::FaceBound MovingMesh::bound_by_motion(std::uint32_t face) const {
  double step = 0;
  for (const std::uint32_t v : corners_of(face)) step = std::max(step, step_[v]);
  FaceBound bound;
  if (step == 0) {
    bound.distance = distance_[face];
    if (facing_) bound.facing.room = facing_->room(face);
    return bound;
  }
  const double distance = (distance_[face] + step) * (1 + kRoundUp);
  if (!(distance <= kEasy * limit_) || is_too_long(face)) return bound;
  if (facing_) {
    bound.facing.room = facing_->room(face) - step;
    if (!(bound.facing.room > 0)) {
      bound.facing.room = std::numeric_limits<double>::infinity();
      for_triangles(face, [&](std::size_t k, const TriangleCorners& at, const auto&) {
        facing_->follow(face, k, at, bound.facing.room);
        return bound.facing.room >= 0;
      });
      if (bound.facing.room < 0) return bound;
    }
  }
  bound.distance = distance;
  return bound;
}

/// The largest distance of any triangle that the face may consist of.
double MovingMesh::distance_by(const TriangleCertificate& certificate, std::uint32_t face, MovingFacing::Known& known,
                               Blame* blame) const {
  double largest = 0;
  known.room = std::numeric_limits<double>::infinity();
  for_triangles(face, [&](std::size_t k, const TriangleCorners& at, const PointBound* const(&of)[3]) {
    const glm::dvec3 bounds(of[0]->distance, of[1]->distance, of[2]->distance);
    const glm::uvec3 hints(of[0]->triangle, of[1]->triangle, of[2]->triangle);
    std::optional<Facing> facing;
    if (facing_) {
      if (!facing_->start(face, k, at, facing)) largest = kUnproved;
      if (facing) facing->set_corners(hints);
    }
    if (largest != kUnproved) {
      Facing* const rule = facing ? &*facing : nullptr;
      glm::dvec3 open(std::numeric_limits<double>::quiet_NaN());
      if (const std::optional<glm::dvec3> point = certificate.point_outside(at, rule, hints)) {
        largest = kUnproved, open = *point;
      } else {
        largest = std::max(largest, certificate.bound_in_any_order(at, bounds, hints, rule, blame ? &open : nullptr));
      }
      if (blame && largest == kUnproved) {
        blame->triangle = static_cast<std::uint32_t>(k);
        blame->weights = closest_point(open, at[0], at[1], at[2]).weights;
      }
    }
    if (facing_ && largest != kUnproved) facing_->renew(face, k, at, facing, known);
    return largest != kUnproved;
  });
  return largest;
}

MovingMesh::FaceBound MovingMesh::bound_by_certificate(std::uint32_t face, Blame* blame) const {
  FaceBound bound;
  for (const std::uint32_t v : corners_of(face)) {
    if (trial_[v].bound.distance > limit_) return bound;
  }
  // The first question is the one that Certificate asks, so that it proves the face again; then comes the headroom.
  for (const TriangleCertificate& certificate : certificates_) {
    bound.distance = distance_by(certificate, face, bound.facing, blame);
    if (bound.distance <= limit_ || bound.distance == kUnproved) break;
  }
  return bound;
}

/// Whether no proof of the face is possible on trial, because the point that was open last is open there, too. What is
/// known of the corners' distances does not matter.
bool MovingMesh::refuses_again(std::uint32_t face, const Blame& blame) const {
  if (std::isnan(blame.weights.x) || bound_by_motion(face).distance != kUnproved) return false;
  bool refuses = false;
  for_triangles(face, [&](std::size_t k, const TriangleCorners& at, const auto&) {
    if (k != blame.triangle) return true;
    std::optional<Facing> facing;
    if (facing_ && !facing_->start(face, k, at, facing)) return false;
    const glm::dvec3 p = blame.weights.x * at[0] + blame.weights.y * at[1] + blame.weights.z * at[2];
    refuses = certificates_.back().is_open(p, facing ? &*facing : nullptr);
    return false;
  });
  return refuses;
}

void MovingMesh::set_trial_bound(std::uint32_t face, const FaceBound& bound) {
  trial_distance_[face] = bound.distance;
  if (facing_) facing_->set_trial(face, bound.facing);
}

/// Makes what is known of a face on trial the state.
void MovingMesh::accept(std::uint32_t face) {
  distance_[face] = trial_distance_[face];
  if (facing_) facing_->accept(face);
}

void MovingMesh::measure(std::span<const std::uint32_t> faces, Progress* progress) {
  std::vector<std::uint32_t> unknown;
  for (const std::uint32_t f : faces) {
    for (const std::uint32_t v : corners_of(f)) {
      if (trial_[v].bound.distance != kUnknown) continue;
      trial_[v].bound.distance = kFar;  // so that each vertex is added once
      unknown.push_back(v);
    }
  }
  try {
    parallel_for(unknown.size(), kFewAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
      if (progress) progress->poll();
      for (std::size_t i = begin; i < end; ++i) {
        VertexState& state = trial_[unknown[i]];
        state.bound = bound_at(unknown[i], state.at, Aim::wish);
      }
    });
  } catch (...) {  // Vertices that do not move are not taken back.
    for (const std::uint32_t v : unknown) trial_[v].bound = {};
    throw;
  }
}

/// Writes trial_distance_ of all these faces.
std::vector<std::uint32_t> MovingMesh::failing(std::span<const std::uint32_t> faces, Progress* progress) {
  if (progress) progress->poll();
  std::vector<std::uint32_t> open = select(faces.size(), threads_, [&](std::size_t i) {
    const FaceBound bound = bound_by_motion(faces[i]);
    set_trial_bound(faces[i], bound);
    return bound.distance == kUnproved;
  });
  for (std::uint32_t& i : open) i = faces[i];
  return uncertified(open, progress);
}

/// Writes trial_distance_ of all these faces.
std::vector<std::uint32_t> MovingMesh::uncertified(std::span<const std::uint32_t> faces, Progress* progress) {
  measure(faces, progress);
  std::vector<std::uint8_t> failed(faces.size());
  parallel_for(faces.size(), kFewAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->poll();
    for (std::size_t i = begin; i < end; ++i) {
      const FaceBound bound = bound_by_certificate(faces[i]);
      set_trial_bound(faces[i], bound);
      failed[i] = bound.distance == kUnproved;
    }
  });
  return chosen(faces, failed);
}

void MovingMesh::try_all(std::span<const std::uint32_t> vertices, std::span<const glm::dvec3> before,
                         std::span<const glm::dvec3> after) {
  const std::size_t offender = first_of(vertices.size(), threads_, [&](std::size_t i) {
    const std::uint32_t v = vertices[i];
    if (frozen_[v]) return !finite(after[i]);
    const glm::dvec3 at = space_.frame(after[i]);
    try_at(v, glm::clamp(at, -kFarthest, kFarthest), {});
    const glm::dvec3 way = at - state_[v].at;
    if (at != trial_[v].at) step_[v] = std::hypot(way.x, way.y, way.z);
    return !finite(after[i] - before[i]) || !finite(at);
  });
  if (offender == vertices.size()) return;
  for (const std::uint32_t v : vertices) take_back(v);
  const bool far = finite(after[offender]);
  refuse("the wish for vertex", vertices[offender], after[offender],
         far ? "is too far away for double precision" : "is not finite", far ? "too_far" : "invalid_mesh");
}

void MovingMesh::try_at(std::uint32_t vertex, const glm::dvec3& at, const PointBound& bound) {
  // What is known of a place must not depend on the way there, although a guess would do for a shorter distance.
  set_trial(vertex, {at, certificates_.front().leaves_room(bound.distance) ? PointBound{} : bound});
}

void MovingMesh::set_trial(std::uint32_t vertex, const VertexState& state) {
  trial_[vertex] = state;
  step_[vertex] = glm::length(state.at - state_[vertex].at);
}

bool MovingMesh::try_alone(std::uint32_t vertex, const glm::dvec3& at, Blame& blame) {
  const VertexState from = trial_[vertex];
  if (at == from.at) return true;
  const double step = step_[vertex];
  const auto faces = ring(vertex);
  const auto refuse = [&] {
    trial_[vertex] = from, step_[vertex] = step;
    return false;
  };
  set_trial(vertex, {at, {}});
  if (refuses_again(faces[blame.place], blame)) return refuse();
  trial_[vertex].bound = bound_at(vertex, at, Aim::ahead);
  if (trial_[vertex].bound.distance > limit_) return refuse();
  thread_local std::vector<FaceBound> bounds;
  bounds.resize(faces.size());
  const std::size_t first = blame.place;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::size_t place = (i + first) % faces.size();
    Blame other{static_cast<std::uint32_t>(place)};
    bounds[place] = bound_by_motion(faces[place]);
    if (bounds[place].distance != kUnproved) continue;
    bounds[place] = bound_by_certificate(faces[place], &other);
    if (bounds[place].distance != kUnproved) continue;
    blame = other;
    return refuse();
  }
  for (std::size_t i = 0; i < faces.size(); ++i) set_trial_bound(faces[i], bounds[i]);
  return true;
}

void MovingMesh::accept(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces) {
  parallel_for(vertices.size(), kManyAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
    for (const std::uint32_t v : vertices.subspan(begin, end - begin)) state_[v] = trial_[v], step_[v] = 0;
  });
  parallel_for(faces.size(), kManyAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
    for (const std::uint32_t f : faces.subspan(begin, end - begin)) accept(f);
  });
}

}  // namespace tolvol
