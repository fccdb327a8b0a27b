// SPDX-License-Identifier: GPL-3.0-or-later
// No point of a face is farther from the reference than before by more than the longest step of its corners: this
// settles almost all faces without a question to the reference. The witness certificate decides about the others.
#include "motion/moving_mesh.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <numeric>
#include <sstream>
#include <utility>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/input_checks.h"
#include "geometry/closest_point.h"
#include "topology/orientation.h"
#include "topology/sides.h"
#include "topology/t_junctions.h"

namespace tolvol {
namespace {

/// A share of the provable distance. The certificate proves a face that is nearer than it whatever the face's shape,
/// because the parts that it splits into become smaller than the rest of the distance. So every face that is settled
/// without the certificate is one that the certificate could prove.
constexpr double kEasy = 0.98;
/// Distances are known up to this multiple of the provable distance.
constexpr double kKnown = 2;
/// A bound on the rounding of distances in the frame.
constexpr double kRounding = 0x1p-44;
/// A bound on the relative rounding of a step's length, and of a sum with it.
constexpr double kInflate = 0x1p-50;
/// The numbers of faces or vertices that a thread takes at a time, for work of about 10 ns and of about 1 us each.
constexpr std::size_t kBlock = 1024, kSmallBlock = 32;
// A trial beyond this, in frame lengths, is here instead: the squares of its coordinates do not overflow, and it is as
// far outside.
constexpr double kFarthest = 0x1p500;

bool finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

[[noreturn]] void refuse(const std::string& name, std::size_t vertex, const glm::dvec3& p, const char* what,
                         const char* code) {
  std::ostringstream text;
  text << name << " " << vertex << " " << what << " (" << p.x << ", " << p.y << ", " << p.z << ")";
  throw InvalidInput(text.str(), code);
}

/// The least index in [0, count) for which hits(i) holds; count when there is none.
template <class Hits>
std::size_t first_of(std::size_t count, unsigned threads, Hits&& hits) {
  std::atomic<std::size_t> least{count};
  parallel_for(count, kBlock, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!hits(i)) continue;
      for (std::size_t known = least; i < known && !least.compare_exchange_weak(known, i);) {
      }
    }
  });
  return least;
}

/// The indices in [0, count) for which choose(i) holds, ascending.
template <class Choose>
std::vector<std::uint32_t> select(std::size_t count, unsigned threads, Choose&& choose) {
  std::vector<std::vector<std::uint32_t>> chosen((count + kBlock - 1) / kBlock);
  parallel_for(count, kBlock, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (choose(i)) chosen[begin / kBlock].push_back(static_cast<std::uint32_t>(i));
    }
  });
  std::vector<std::uint32_t> result;
  for (const std::vector<std::uint32_t>& part : chosen) result.insert(result.end(), part.begin(), part.end());
  return result;
}

std::vector<std::uint32_t> chosen(std::span<const std::uint32_t> from, std::span<const std::uint8_t> marked) {
  std::vector<std::uint32_t> result;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (marked[i]) result.push_back(from[i]);
  }
  return result;
}

}  // namespace

MovingMesh::MovingMesh(const ToleranceVolume& volume, const StoredSpace& space, std::span<const std::uint32_t> faces,
                       int corners, std::size_t vertex_count, unsigned threads)
    : volume_(&volume),
      space_(space.in(volume.frame())),
      faces_(faces),
      corners_(static_cast<std::size_t>(corners)),
      threads_(threads) {
  if (corners < 1 || corners > 4) throw InvalidInput("a face must have 1 to 4 corners; triangulate larger ones");
  if (faces.size() % corners_ != 0) throw InvalidInput("the face array is not a whole number of faces");
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i] >= vertex_count) {
      throw InvalidInput("face " + std::to_string(i / corners_) + " uses vertex " + std::to_string(faces[i]) +
                             ", but there are only " + std::to_string(vertex_count),
                         "invalid_mesh");
    }
  }
  make_rings(vertex_count);
}

void MovingMesh::make_rings(std::size_t vertex_count) {
  ring_start_.assign(vertex_count + 1, 0);
  const auto each_use = [&](auto&& use) {
    for (std::uint32_t f = 0; f < faces_.size() / corners_; ++f) {
      poll_at(f);
      const auto corners = corners_of(f);
      for (std::size_t k = 0; k < corners_; ++k) {
        if (std::find(corners.begin(), corners.begin() + k, corners[k]) == corners.begin() + k) use(corners[k], f);
      }
    }
  };
  each_use([&](std::uint32_t v, std::uint32_t) { ++ring_start_[v + 1]; });
  for (std::size_t v = 0; v < vertex_count; ++v) ring_start_[v + 1] += ring_start_[v];
  seen_.assign(faces_.size() / corners_, 0);
  ring_.resize(ring_start_.back());
  std::vector<std::uint32_t> next(ring_start_.begin(), ring_start_.end() - 1);
  each_use([&](std::uint32_t v, std::uint32_t f) { ring_[next[v]++] = f; });
}

MovingMesh::Start MovingMesh::start(std::span<const glm::dvec3> stored, double max_normal_angle,
                                    std::span<const std::uint32_t> place, Progress* progress) {
  std::vector<glm::dvec3> used;
  for (std::uint32_t v = 0; v < stored.size(); ++v) {
    poll_at(v);
    if (!finite(stored[v])) refuse("vertex", v, stored[v], "is not finite", "invalid_mesh");
    if (!ring(v).empty()) used.push_back(stored[v]);
  }
  Start result;
  if (const auto warning = storage_warning(*volume_, space_, used)) result.warnings.push_back(*warning);
  // Vertices may end up anywhere in the volume. The error grows no faster than the distance, so that twice the volume
  // leaves no room for a point that only seems to be in it.
  const double mapping_error = space_.mapping_error(used, 2 * (1 + volume_->frame_tolerance()));
  provable_ = volume_->provable(mapping_error);
  limit_ = provable_ * (1 - kHeadroom);
  certificates_.clear();
  for (const double limit : {provable_, limit_}) {
    certificates_.emplace_back(volume_->witnesses(), volume_->grid(), volume_->hierarchy(), limit,
                               volume_->refutable(mapping_error));
  }

  state_.resize(stored.size());
  if (progress) progress->begin("checking");
  const std::size_t offender = first_of(stored.size(), threads_, [&](std::size_t v) {
    state_[v] = {space_.frame(stored[v]), {}};
    return !finite(state_[v].at) && !ring(static_cast<std::uint32_t>(v)).empty();
  });
  if (offender < stored.size()) {
    refuse("vertex", offender, stored[offender], "is too far away for double precision", "too_far");
  }
  trial_ = state_;
  if (!refusals_.empty()) refusals_.assign(stored.size(), {});
  step_.assign(stored.size(), 0);
  frozen_.assign(stored.size(), false), any_frozen_ = false;
  const std::size_t count = faces_.size() / corners_;
  reach_.assign(count, 0);
  trial_reach_.assign(count, 0);
  facing_.reset(), exceeding_.clear();
  max_normal_angle_ = max_normal_angle;
  std::optional<FacingRule> rule;
  if (corners_ >= 3) rule = facing_rule(*volume_, mapping_error, max_normal_angle, result.warnings);
  if (rule) start_facing(std::move(*rule), place);
  const std::vector<std::uint32_t> open =
      select(count, threads_, [&](std::size_t f) { return !is_own(static_cast<std::uint32_t>(f)); });
  measure(open, progress);
  std::vector<std::uint32_t> failing = uncertified(open, progress);
  std::vector<std::uint8_t> outside(failing.size());
  parallel_for(failing.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(static_cast<double>(begin) / static_cast<double>(failing.size()));
    for (std::size_t i = begin; i < end; ++i) outside[i] = !is_inside(failing[i]);
  });
  result.outside = chosen(failing, outside);
  for (const std::uint32_t f : result.outside) {
    for (const std::uint32_t v : corners_of(f)) freeze(v);
    for (std::size_t k = 0; facing_ && k < triangles_of(corners()).size(); ++k) facing_->of(f, k) = {};
  }
  if (!facing_) return result;
  std::erase_if(failing, [&](std::uint32_t f) { return std::ranges::binary_search(result.outside, f); });
  failing = compare_sides(std::move(failing), progress);
  std::vector<std::uint8_t> exceeds(failing.size());
  parallel_for(failing.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(static_cast<double>(begin) / static_cast<double>(failing.size()));
    for (std::size_t i = begin; i < end; ++i) exceeds[i] = limit_angle(failing[i]);
  });
  exceeding_ = chosen(failing, exceeds);
  return result;
}

/// Calls visit(triangle's number in the face, its corners on trial, what is known of them) until it returns false.
template <class Visit>
void MovingMesh::for_triangles(std::uint32_t face, Visit&& visit) const {
  const auto corner = corners_of(face);
  std::size_t triangle = 0;
  for (const auto& [a, b, c] : triangles_of(static_cast<int>(corners_))) {
    const VertexState &p = trial_[corner[a]], &q = trial_[corner[b]], &r = trial_[corner[c]];
    const glm::dvec3 corners[3] = {p.at, q.at, r.at};
    const PointBound* const bounds[3] = {&p.bound, &q.bound, &r.bound};
    if (!visit(triangle++, corners, bounds)) return;
  }
}

/// Whether no two triangles run along an edge in one direction, and no two vertices are at one place. If so, no edge
/// has more than two triangles, and neighbours look to one side.
bool MovingMesh::is_plainly_oriented(std::span<const std::uint32_t> place) const {
  if (corners_ != 3) return false;
  std::atomic<bool> result{true};
  parallel_for(vertex_count(), kBlock, threads_, [&](std::size_t begin, std::size_t end) {
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
void MovingMesh::start_facing(FacingRule rule, std::span<const std::uint32_t> place) {
  Team team(threads_);
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
    facing_->reverse_reference(sides.reversed, volume_->hierarchy());
  } else {
    const std::vector<std::uint32_t> same = weld_equal_positions(reference.vertices);
    std::vector<glm::uvec3> places;
    for (const glm::uvec3& t : reference.triangles) places.emplace_back(same[t.x], same[t.y], same[t.z]);
    facing_->reverse_reference(orientation(places, same.size(), team).reversed, volume_->hierarchy());
  }
  part_.assign(is_plain ? 0 : face_count(), 0);
  parallel_for(face_count(), kBlock, threads_, [&](std::size_t begin, std::size_t end) {
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

/// Certifies faces of the state, and returns those for which there is no proof by a search as in any motion.
std::vector<std::uint32_t> MovingMesh::uncertified(std::span<const std::uint32_t> faces, Progress* progress) {
  std::vector<std::uint8_t> fails(faces.size());
  parallel_for(faces.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(static_cast<double>(begin) / static_cast<double>(faces.size()));
    for (std::size_t i = begin; i < end; ++i) {
      Reach reach = reach_by_certificate(faces[i]);
      fails[i] = reach.distance == kUnproved;
      // Beyond the state as it is, nothing is known of such a face.
      if (fails[i]) reach.distance = provable_;
      set_trial_reach(faces[i], reach);
      accept(faces[i]);
    }
  });
  return chosen(faces, fails);
}

/// Whether the face is proved to be within the tolerance on trial, whichever way it is turned.
bool MovingMesh::is_inside(std::uint32_t face) const {
  bool inside = true;
  for_triangles(face, [&](std::size_t, const TriangleCorners& at, const PointBound* const(&known)[3]) {
    const glm::dvec3 bounds(known[0]->distance, known[1]->distance, known[2]->distance);
    const glm::uvec3 near(known[0]->triangle, known[1]->triangle, known[2]->triangle);
    return inside = certificates_.front().verdict(at, bounds, near) == Verdict::inside;
  });
  return inside;
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
    const std::vector<std::uint32_t> still = uncertified(faces, progress);
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
  Reach reach{provable_, {}};
  for_triangles(face, [&](std::size_t k, const TriangleCorners& at, const PointBound* const(&known)[3]) {
    FaceRule& rule = facing_->of(face, k);
    const glm::dvec3 bounds(known[0]->distance, known[1]->distance, known[2]->distance);
    const glm::uvec3 near(known[0]->triangle, known[1]->triangle, known[2]->triangle);
    std::optional<Facing> facing, proved;
    const auto prove = [&](double limit) -> std::optional<double> {
      rule.limit = limit;
      facing.reset();
      facing_->start(face, k, at, facing);
      if (!facing) return 0;
      facing->set_corners(near);
      if (certificates_.front().verdict(at, bounds, near, &*facing) != Verdict::inside) return {};
      proved = facing;
      return facing->angle();
    };
    if (rule.limit < std::numbers::pi && !prove(rule.limit)) {
      exceeds = true;
      rule.limit = least_limit(facing_->rule().angle, prove);
    }
    facing_->renew(face, k, at, proved, reach.facing);
    return true;
  });
  reach_[face] = provable_;
  const Reach found = reach_by_certificate(face);
  if (found.distance != kUnproved) reach = found;
  reach.facing.room = found.distance == kUnproved ? 0 : found.facing.room;
  set_trial_reach(face, reach);
  accept(face);
  return exceeds;
}

bool MovingMesh::is_own(std::uint32_t face) const {
  const TriangleMesh& reference = volume_->reference();
  if (corners_ != 3 || face >= reference.triangles.size()) return false;
  for (int k = 0; k < 3; ++k) {
    if (state_[corners_of(face)[k]].at != reference.vertices[reference.triangles[face][k]]) return false;
  }
  return true;
}

std::optional<std::string> MovingMesh::hold_t_junctions(std::span<const glm::dvec3> stored,
                                                        std::span<const std::uint32_t> place) {
  if (corners_ < 3) return std::nullopt;
  TriangleMesh mesh{{stored.begin(), stored.end()}, {}};
  for (std::uint32_t f = 0; f < face_count(); ++f) {
    const std::span<const std::uint32_t> c = corners_of(f);
    for (std::size_t k = 1; k + 1 < c.size(); ++k) {
      const glm::uvec3 t(place[c[0]], place[c[k]], place[c[k + 1]]);
      if (t.x != t.y && t.y != t.z && t.z != t.x) mesh.triangles.push_back(t);
    }
  }
  Team team(threads_);
  std::vector<Side> sides(3 * mesh.triangles.size());
  std::iota(sides.begin(), sides.end(), 0u);
  const auto end_of = [&](Side corner) { return mesh.triangles[corner / 3][corner % 3]; };
  std::vector<glm::uvec2> open;
  by_ends(sides, stored.size(), team, end_of, [&](const std::vector<Side>& alike) {
    if (alike.size() == 1) open.emplace_back(end_of(alike[0]), end_of(next_corner(alike[0])));
  });
  std::size_t held = 0;
  for (const std::uint32_t v : t_junctions(std::move(mesh), open, space_.unit_roundoff(), team)) {
    held += !frozen(v);
    freeze(v);
  }
  if (held == 0) return std::nullopt;
  return std::to_string(held) + (held == 1 ? " vertex holds" : " vertices hold") +
         " T-junctions together and cannot move";
}

std::vector<std::uint32_t> MovingMesh::faces_around(std::span<const std::uint32_t> vertices) {
  ++now_;
  std::vector<std::uint32_t> faces;
  for (const std::uint32_t v : vertices) {
    for (const std::uint32_t f : ring(v)) {
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
  if (room > 0) known[static_cast<std::size_t>(aim)] = {at, room - kRounding};
  return found;
}

MovingMesh::Reach MovingMesh::reach_by_motion(std::uint32_t face) const {
  double step = 0;
  for (const std::uint32_t v : corners_of(face)) step = std::max(step, step_[v]);
  Reach reach;
  if (step == 0) {
    reach.distance = reach_[face];
    if (facing_) reach.facing.room = facing_->room(face);
    return reach;
  }
  const double distance = (reach_[face] + step) * (1 + kInflate);
  if (!(distance <= kEasy * limit_)) return reach;
  if (facing_) {
    reach.facing.room = facing_->room(face) - step;
    if (!(reach.facing.room > 0)) {
      reach.facing.room = std::numeric_limits<double>::infinity();
      for_triangles(face, [&](std::size_t k, const TriangleCorners& at, const auto&) {
        facing_->follow(face, k, at, reach.facing.room);
        return reach.facing.room >= 0;
      });
      if (reach.facing.room < 0) return reach;
    }
  }
  reach.distance = distance;
  return reach;
}

/// The largest distance of any triangle that the face may consist of.
double MovingMesh::distance_by(const TriangleCertificate& certificate, std::uint32_t face, MovingFacing::Known& known,
                               Blame* blame) const {
  double largest = 0;
  known.room = std::numeric_limits<double>::infinity();
  for_triangles(face, [&](std::size_t k, const TriangleCorners& at, const PointBound* const(&of)[3]) {
    const glm::dvec3 bounds(of[0]->distance, of[1]->distance, of[2]->distance);
    const glm::uvec3 near(of[0]->triangle, of[1]->triangle, of[2]->triangle);
    std::optional<Facing> facing;
    if (facing_) {
      if (!facing_->start(face, k, at, facing)) largest = kUnproved;
      if (facing) facing->set_corners(near);
    }
    if (largest != kUnproved) {
      Facing* const rule = facing ? &*facing : nullptr;
      glm::dvec3 open(std::numeric_limits<double>::quiet_NaN());
      largest = std::max(largest, certificate.bound_in_any_order(at, bounds, near, rule, blame ? &open : nullptr));
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

MovingMesh::Reach MovingMesh::reach_by_certificate(std::uint32_t face, Blame* blame) const {
  Reach reach;
  for (const std::uint32_t v : corners_of(face)) {
    if (trial_[v].bound.distance > limit_) return reach;
  }
  // The first question is the one that Certificate asks, so that it proves the face again; then comes the headroom.
  for (const TriangleCertificate& certificate : certificates_) {
    reach.distance = distance_by(certificate, face, reach.facing, blame);
    if (reach.distance <= limit_ || reach.distance == kUnproved) break;
  }
  return reach;
}

/// Whether no proof of the face is possible on trial, because the point that was open last is open there, too.
bool MovingMesh::refuses_again(std::uint32_t face, const Blame& blame) const {
  if (std::isnan(blame.weights.x)) return false;
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

/// What is known on trial of a face that is to blame for the last refusal.
MovingMesh::Reach MovingMesh::reach_of_blamed(std::uint32_t face, Blame& blame) const {
  const Reach reach = reach_by_motion(face);
  if (reach.distance != kUnproved) return reach;
  if (refuses_again(face, blame)) return {};
  return reach_by_certificate(face, &blame);
}

void MovingMesh::set_trial_reach(std::uint32_t face, const Reach& reach) {
  trial_reach_[face] = reach.distance;
  if (facing_) facing_->set_trial(face, reach.facing);
}

/// Makes what is known of a face on trial the state.
void MovingMesh::accept(std::uint32_t face) {
  reach_[face] = trial_reach_[face];
  if (facing_) facing_->accept(face);
}

std::vector<std::uint32_t> MovingMesh::turned(std::span<const std::uint32_t> faces, Progress* progress) {
  if (!facing_) return {};
  const std::vector<std::uint32_t> open = failing(faces, progress);
  std::vector<std::uint8_t> turned(open.size());
  parallel_for(open.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(progress->fraction());
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
    if (exceeded) {
      result.exceeded_after += of_face > angle;
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

void MovingMesh::measure(std::span<const std::uint32_t> faces, Progress* progress) {
  std::vector<std::uint32_t> unknown;
  for (const std::uint32_t f : faces) {
    for (const std::uint32_t v : corners_of(f)) {
      if (trial_[v].bound.distance != kUnknown) continue;
      trial_[v].bound.distance = kFar;  // once each
      unknown.push_back(v);
    }
  }
  parallel_for(unknown.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(progress->fraction());
    for (std::size_t i = begin; i < end; ++i) {
      VertexState& state = trial_[unknown[i]];
      state.bound = bound_at(unknown[i], state.at, Aim::wish);
    }
  });
}

/// Writes trial_reach_ of all these faces.
std::vector<std::uint32_t> MovingMesh::failing(std::span<const std::uint32_t> faces, Progress* progress) {
  if (progress) progress->update(progress->fraction());
  std::vector<std::uint32_t> open = select(faces.size(), threads_, [&](std::size_t i) {
    const Reach reach = reach_by_motion(faces[i]);
    set_trial_reach(faces[i], reach);
    return reach.distance == kUnproved;
  });
  for (std::uint32_t& i : open) i = faces[i];
  measure(open, progress);
  std::vector<std::uint8_t> failed(open.size());
  parallel_for(open.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(progress->fraction());
    for (std::size_t i = begin; i < end; ++i) {
      const Reach reach = reach_by_certificate(open[i]);
      set_trial_reach(open[i], reach);
      failed[i] = reach.distance == kUnproved;
    }
  });
  return chosen(open, failed);
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
  const PointBound there = bound_at(vertex, at, Aim::ahead);
  const double step = step_[vertex];
  if (there.distance > limit_) return false;
  set_trial(vertex, {at, there});
  const auto faces = ring(vertex);
  thread_local std::vector<Reach> reach;
  reach.resize(faces.size());
  const std::size_t first = blame.place;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::size_t place = (i + first) % faces.size();
    Blame other{static_cast<std::uint32_t>(place)};
    reach[place] = reach_of_blamed(faces[place], i == 0 ? blame : other);
    if (reach[place].distance != kUnproved) continue;
    if (i > 0) blame = other;
    trial_[vertex] = from, step_[vertex] = step;
    return false;
  }
  for (std::size_t i = 0; i < faces.size(); ++i) set_trial_reach(faces[i], reach[i]);
  return true;
}

void MovingMesh::accept(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces) {
  parallel_for(vertices.size(), kBlock, threads_, [&](std::size_t begin, std::size_t end) {
    for (const std::uint32_t v : vertices.subspan(begin, end - begin)) state_[v] = trial_[v], step_[v] = 0;
  });
  parallel_for(faces.size(), kBlock, threads_, [&](std::size_t begin, std::size_t end) {
    for (const std::uint32_t f : faces.subspan(begin, end - begin)) accept(f);
  });
}

}  // namespace tolvol
