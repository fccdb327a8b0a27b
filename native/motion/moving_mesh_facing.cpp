// SPDX-License-Identifier: GPL-3.0-or-later
// How the faces of a moving mesh face the reference: by which side each part is compared, which angle each face keeps,
// and which faces exceed it.
#include <algorithm>
#include <atomic>
#include <numbers>

#include "base/call.h"
#include "base/parallel.h"
#include "geometry/weld.h"
#include "motion/moving_mesh.h"
#include "motion/selection.h"
#include "topology/orientation.h"

namespace tolvol {

/// Whether no two triangles run along an edge in one direction, and no two vertices are at one place. If so, no edge
/// has more than two triangles, and neighbours look to one side.
bool MovingMesh::is_plainly_oriented(std::span<const std::uint32_t> place) const {
  if (corners_ != 3) return false;
  std::atomic<bool> result{true};
  parallel_for(vertex_count(), kManyAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> next;
    for (auto v = static_cast<std::uint32_t>(begin); v < end && result; ++v) {
      next.clear();
      for (const std::uint32_t f : ring(v)) {
        const auto corner = corners_of(f);
        const std::size_t k = std::ranges::find(corner, v) - corner.begin();
        next.push_back(corner[(k + 1) % 3]);
      }
      std::ranges::sort(next);
      const bool twice = std::ranges::adjacent_find(next) != next.end();
      if (twice || (!place.empty() && place[v] != v)) result = false;
    }
  });
  return result;
}

/// Prepares the rules of all faces. Those of the reference itself are their own witnesses.
void MovingMesh::start_facing(FacingRule rule, std::span<const std::uint32_t> place, Team& team) {
  const TriangleMesh& reference = volume_->reference();
  const std::span<const PieceTriangle> triangles = triangles_of(corners());
  // The two triangles of one triangulation of a quad are neighbours, so that a quad is a part of one.
  const std::size_t of_face = std::min<std::size_t>(triangles.size(), 2);
  const bool is_reference =
      face_count() == reference.triangles.size() && first_of(face_count(), threads_, [&](std::size_t f) {
                                                      return !is_own(static_cast<std::uint32_t>(f));
                                                    }) == face_count();
  Orientation sides;
  // The faces of the reference itself keep their angle at the start, so that nothing is asked about their parts.
  const bool is_plain = is_reference && is_plainly_oriented(place);
  if (!is_plain) {
    std::vector<glm::uvec3> places;
    places.reserve(of_face * face_count());
    for (std::uint32_t f = 0; f < face_count(); ++f) {
      const auto corner = corners_of(f);
      for (const auto& [a, b, c] : triangles.first(of_face)) {
        places.emplace_back(corner[a], corner[b], corner[c]);
        for (int k = 0; k < 3 && !place.empty(); ++k) places.back()[k] = place[places.back()[k]];
      }
    }
    sides = orientation(places, vertex_count(), team);
  }
  facing_.emplace(std::move(rule), face_count(), corners());
  if (is_reference) {
    facing_->reverse_reference(sides.reversed, volume_->hierarchy(), team);
  } else {
    const std::vector<std::uint32_t> same = weld_equal_positions(reference.vertices, team);
    std::vector<glm::uvec3> places;
    places.reserve(reference.triangles.size());
    for (const glm::uvec3& t : reference.triangles) places.emplace_back(same[t.x], same[t.y], same[t.z]);
    facing_->reverse_reference(orientation(places, same.size(), team).reversed, volume_->hierarchy(), team);
  }
  part_.assign(is_plain ? 0 : face_count(), 0);
  parallel_for(face_count(), kManyAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
    for (auto f = static_cast<std::uint32_t>(begin); f < end; ++f) {
      const auto corner = corners_of(f);
      // A triangle among quads repeats a corner, and then one of the two has no neighbours.
      std::size_t first = of_face * f;
      if (of_face > 1 && (corner[0] == corner[1] || corner[1] == corner[2])) ++first;
      if (!is_plain) part_[f] = sides.part[first];
      const bool reversed = !is_plain && sides.reversed[first];
      const bool own = is_reference || is_own(f);
      for_triangles(f, [&](std::size_t k, const TriangleCorners& at, const auto&) {
        const auto [a, b, c] = triangles[k];
        if (corner[a] == corner[b] || corner[b] == corner[c] || corner[c] == corner[a]) return true;
        const std::optional<glm::dvec3> normal = sure_normal(at[0], at[1], at[2], facing_->rule().mesh_error);
        facing_->of(f, k) = {facing_->rule().angle, reversed, !normal};
        if (own) facing_->start_own(f, k, at, normal);
        return true;
      });
    }
  });
}

bool MovingMesh::may_be_unsure(std::uint32_t face) const {
  if (!facing_) return false;
  for (std::size_t k = 0; k < triangles_of(corners()).size(); ++k) {
    if (facing_->of(face, k).may_be_unsure) return true;
  }
  return false;
}

/// For each part: by how much the area of its faces that keep their angle is larger than that of the failing ones.
std::vector<double> MovingMesh::balance(std::span<const std::uint32_t> failing) const {
  std::vector<double> result(2 * face_count(), 0);
  for (std::uint32_t f = 0, i = 0; f < face_count(); ++f) {
    poll_at(f);
    const auto corner = corners_of(f);
    double area = 0;
    for (std::size_t k = 1; k + 1 < corner.size(); ++k) {
      const glm::dvec3& a = state(corner[0]);
      area += glm::length(glm::cross(state(corner[k]) - a, state(corner[k + 1]) - a));
    }
    const bool fails = i < failing.size() && failing[i] == f;
    i += fails;
    result[part_[f]] += fails ? -area : area;
  }
  return result;
}

/// Compares a part by its other side if more of its area then keeps the angle. Returns the faces that still fail.
std::vector<std::uint32_t> MovingMesh::compare_sides(std::vector<std::uint32_t> failing, Progress* progress) {
  if (failing.empty()) return failing;
  std::vector<double> kept = balance(failing);
  const auto turn = [&](auto&& is_to_turn) {
    std::vector<std::uint32_t> faces;
    for (std::uint32_t f = 0; f < face_count(); ++f) {
      if (!is_to_turn(part_[f])) continue;
      faces.push_back(f);
      for (std::size_t k = 0; k < triangles_of(corners()).size(); ++k) {
        facing_->of(f, k).reversed = !facing_->of(f, k).reversed;
      }
    }
    if (faces.empty()) return;
    std::erase_if(failing, [&](std::uint32_t f) { return is_to_turn(part_[f]); });
    measure(faces, progress);
    // A face that is free of the rule can fail by its distance alone.
    std::erase_if(faces, [&](std::uint32_t f) { return facing_->of(f, 0).limit >= std::numbers::pi && !is_inside(f); });
    const std::vector<std::uint32_t> still = take_uncertified(faces, progress);
    failing.insert(failing.end(), still.begin(), still.end());
    std::ranges::sort(failing);
  };
  turn([&](std::uint32_t part) { return kept[part] < 0; });
  const std::vector<double> turned = balance(failing);
  turn([&](std::uint32_t part) { return kept[part] < 0 && !(turned[part] > kept[part]); });
  return failing;
}

/// Gives a face of the state that failed the limit that it can keep. Returns whether it exceeds the angle of the rule.
bool MovingMesh::limit_angle(std::uint32_t face) {
  bool exceeds = false;
  FaceBound bound{provable_, {}};
  for_triangles(face, [&](std::size_t k, const TriangleCorners& at, const PointBound* const(&known)[3]) {
    FaceRule& rule = facing_->of(face, k);
    const glm::dvec3 bounds(known[0]->distance, known[1]->distance, known[2]->distance);
    const glm::uvec3 hints(known[0]->triangle, known[1]->triangle, known[2]->triangle);
    std::optional<Facing> facing, proved;
    const auto prove = [&](double limit) -> std::optional<double> {
      rule.limit = limit;
      facing.reset();
      facing_->start(face, k, at, facing);
      if (!facing) return 0;
      facing->set_corners(hints);
      if (certificates_.front().verdict(at, bounds, hints, &*facing) != Verdict::inside) return {};
      proved = facing;
      return facing->angle();
    };
    if (rule.limit < std::numbers::pi && !prove(rule.limit)) {
      exceeds = true;
      rule.limit = least_limit(facing_->rule().angle, prove);
    }
    facing_->renew(face, k, at, proved, bound.facing);
    return true;
  });
  distance_[face] = provable_;
  const FaceBound found = bound_by_certificate(face);
  if (found.distance != kUnproved) bound = found;
  bound.facing.room = found.distance == kUnproved ? 0 : found.facing.room;
  set_trial_bound(face, bound);
  accept(face);
  return exceeds;
}

std::vector<std::uint32_t> MovingMesh::turned(std::span<const std::uint32_t> faces, Progress* progress) {
  if (!facing_) return {};
  const std::vector<std::uint32_t> open = failing(faces, progress);
  std::vector<std::uint8_t> turned(open.size());
  parallel_for(open.size(), kFewAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->poll();
    for (std::size_t i = begin; i < end; ++i) {
      for_triangles(open[i], [&](std::size_t k, const TriangleCorners& at, const auto&) {
        std::optional<Facing> facing;
        const glm::dvec3 unknown(kUnknown);
        turned[i] = !facing_->start(open[i], k, at, facing) ||
                    (facing && certificates_.front().verdict(at, unknown, glm::uvec3(Hierarchy::kNone), &*facing) !=
                                   Verdict::inside);
        return !turned[i];
      });
    }
  });
  return chosen(open, turned);
}

void MovingMesh::accept_proved(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces,
                               Progress* progress) {
  const std::vector<std::uint32_t> open = failing(faces, progress);
  accept(vertices, faces);
  if (!facing_) return;
  parallel_for(open.size(), kFewAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->poll();
    for (std::size_t i = begin; i < end; ++i) limit_angle(open[i]);
  });
}

std::optional<Normals> MovingMesh::normals() const {
  if (!facing_) return std::nullopt;
  Normals result;
  std::optional<double> largest;
  const double angle = facing_->rule().angle;
  auto exceeding = exceeding_.begin();
  for (std::uint32_t f = 0; f < face_count(); ++f) {
    poll_at(f);
    const bool exceeded = exceeding != exceeding_.end() && *exceeding == f;
    exceeding += exceeded;
    bool is_unsure = false;
    double of_face = 0;
    const auto corner = corners_of(f);
    std::size_t k = 0;
    for (const auto& [a, b, c] : triangles_of(corners())) {
      if (!exceeded && facing_->of(f, k).limit >= std::numbers::pi) {
        ++k;
        continue;
      }
      const std::optional<double> found =
          facing_->angle(f, k++, {state(corner[a]), state(corner[b]), state(corner[c])});
      if (found) of_face = std::max(of_face, *found);
      is_unsure = is_unsure || !found;
    }
    if (exceeded && of_face > angle) {
      ++result.exceeded_after;
    } else if (is_unsure) {
      ++result.unsure;
    } else if (of_face > 0) {
      largest = std::max(largest.value_or(0), of_face);
    }
  }
  // The conversion to degrees must not round the bound above the option.
  if (largest) result.largest = std::min(glm::degrees(*largest), max_normal_angle_);
  result.exceeded_before = exceeding_.size();
  return result;
}

}  // namespace tolvol
