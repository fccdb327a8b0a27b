// SPDX-License-Identifier: GPL-3.0-or-later
// How a moving mesh takes positions as its state: what is read from the faces, which of them are inside, and which
// vertices never move.
#include <algorithm>
#include <numeric>
#include <utility>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/input_checks.h"
#include "motion/finite.h"
#include "motion/moving_mesh.h"
#include "motion/selection.h"
#include "topology/sides.h"
#include "topology/t_junctions.h"

namespace tolvol {
namespace {

/// The shares of the stage "checking" at which all faces are certified, and at which a search has decided about those
/// that fail. The rest is for the sides and angles of faces.
constexpr double kCertified = 0.6, kSearched = 0.8;

}  // namespace

void require_vertices(std::span<const std::uint32_t> faces, std::size_t corners, std::size_t vertex_count) {
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i] < vertex_count) continue;
    throw InvalidInput("face " + std::to_string(i / corners) + " uses vertex " + std::to_string(faces[i]) +
                           ", but there are only " + std::to_string(vertex_count),
                       "invalid_mesh");
  }
}

MovingMesh::MovingMesh(const ToleranceVolume& volume, const StoredSpace& space, std::span<const std::uint32_t> faces,
                       int corners, std::size_t vertex_count, unsigned threads)
    : volume_(&volume),
      space_(space.in(volume.frame())),
      faces_(faces),
      corners_(static_cast<std::size_t>(corners)),
      threads_(thread_count(threads)) {
  if (corners < 1 || corners > 4) throw InvalidInput("a face must have 1 to 4 corners; triangulate larger ones");
  if (faces.size() % corners_ != 0) throw InvalidInput("the face array is not a whole number of faces");
  require_vertices(faces, corners_, vertex_count);
  state_.resize(vertex_count);
  make_rings();
}

void MovingMesh::make_rings() {
  const std::size_t vertex_count = state_.size();
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
  make_rings();
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
  distance_.assign(count, 0);
  trial_distance_.assign(count, 0);
  facing_.reset(), exceeding_.clear();
  max_normal_angle_ = max_normal_angle;
  if (corners_ >= 3) {
    Team team(threads_);
    std::optional<FacingRule> rule = facing_rule(*volume_, mapping_error, max_normal_angle, result.warnings, team);
    if (rule) start_facing(std::move(*rule), place, team);
  }
  const std::vector<std::uint32_t> open =
      select(count, threads_, [&](std::size_t f) { return !is_own(static_cast<std::uint32_t>(f)); });
  measure(open, progress);
  std::vector<std::uint32_t> failing = take_uncertified(open, progress);
  std::vector<std::uint8_t> outside(failing.size());
  {
    const Progress::Part part(progress, kCertified, kSearched);
    parallel_for(failing.size(), kFewAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
      if (progress) progress->update(static_cast<double>(begin) / static_cast<double>(failing.size()));
      for (std::size_t i = begin; i < end; ++i) outside[i] = !is_inside(failing[i]);
    });
  }
  result.outside = chosen(failing, outside);
  for (const std::uint32_t f : result.outside) {
    for (const std::uint32_t v : corners_of(f)) freeze(v);
    for (std::size_t k = 0; facing_ && k < triangles_of(corners()).size(); ++k) facing_->of(f, k) = {};
  }
  if (!facing_) return result;
  std::erase_if(failing, [&](std::uint32_t f) { return std::ranges::binary_search(result.outside, f); });
  failing = compare_sides(std::move(failing), progress);
  std::vector<std::uint8_t> exceeds(failing.size());
  const Progress::Part part(progress, kSearched, 1);
  parallel_for(failing.size(), kFewAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(static_cast<double>(begin) / static_cast<double>(failing.size()));
    for (std::size_t i = begin; i < end; ++i) exceeds[i] = limit_angle(failing[i]);
  });
  exceeding_ = chosen(failing, exceeds);
  return result;
}

/// Certifies faces of the state, and returns those for which there is no proof by a search as in any motion.
std::vector<std::uint32_t> MovingMesh::take_uncertified(std::span<const std::uint32_t> faces, Progress* progress) {
  std::vector<std::uint8_t> fails(faces.size());
  const Progress::Part part(progress, 0, kCertified);
  parallel_for(faces.size(), kFewAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(static_cast<double>(begin) / static_cast<double>(faces.size()));
    for (std::size_t i = begin; i < end; ++i) {
      FaceBound bound = bound_by_certificate(faces[i]);
      fails[i] = bound.distance == kUnproved;
      // Beyond the state as it is, nothing is known of such a face.
      if (fails[i]) bound.distance = provable_;
      set_trial_bound(faces[i], bound);
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
    const glm::uvec3 hints(known[0]->triangle, known[1]->triangle, known[2]->triangle);
    return inside = certificates_.front().verdict(at, bounds, hints) == Verdict::inside;
  });
  return inside;
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

}  // namespace tolvol
