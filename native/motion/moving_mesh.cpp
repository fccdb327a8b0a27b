// SPDX-License-Identifier: GPL-3.0-or-later
// No point of a face is farther from the reference than before by more than the longest step of its corners: this
// settles almost all faces without a question to the reference. The witness certificate decides about the others.
#include "motion/moving_mesh.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <sstream>
#include <utility>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/input_checks.h"

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

MovingMesh::Start MovingMesh::start(std::span<const glm::dvec3> stored, Progress* progress) {
  std::vector<glm::dvec3> used;
  for (std::uint32_t v = 0; v < stored.size(); ++v) {
    poll_at(v);
    if (!finite(stored[v])) refuse("vertex", v, stored[v], "is not finite", "invalid_mesh");
    if (!ring(v).empty()) used.push_back(stored[v]);
  }
  Start result{{}, storage_warning(*volume_, space_, used)};
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
  std::vector<std::uint32_t> open =
      select(count, threads_, [&](std::size_t f) { return !is_own(static_cast<std::uint32_t>(f)); });
  measure(open, progress);
  std::vector<std::uint8_t> outside(open.size());
  parallel_for(open.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(static_cast<double>(begin) / static_cast<double>(open.size()));
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t f = open[i];
      reach_[f] = reach_by_certificate(f);
      if (reach_[f] != kUnproved) continue;
      reach_[f] = provable_;  // Beyond the state as it is, nothing is known of the face.
      outside[i] = over_triangulations(f, [&](const auto&... triangle) {
                     return certificates_.front().verdict(triangle...) == Verdict::inside ? 0 : kUnproved;
                   }) == kUnproved;
    }
  });
  result.outside = chosen(open, outside);
  for (const std::uint32_t f : result.outside) {
    for (const std::uint32_t v : corners_of(f)) freeze(v);
  }
  return result;
}

bool MovingMesh::is_own(std::uint32_t face) const {
  const TriangleMesh& reference = volume_->reference();
  if (corners_ != 3 || face >= reference.triangles.size()) return false;
  for (int k = 0; k < 3; ++k) {
    if (state_[corners_of(face)[k]].at != reference.vertices[reference.triangles[face][k]]) return false;
  }
  return true;
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

double MovingMesh::reach_by_motion(std::uint32_t face) const {
  double step = 0;
  for (const std::uint32_t v : corners_of(face)) step = std::max(step, step_[v]);
  if (step == 0) return reach_[face];
  const double reach = (reach_[face] + step) * (1 + kInflate);
  return reach <= kEasy * limit_ ? reach : kUnproved;
}

/// The largest value of bound(corners, distances, triangles near them) over the triangles that the face may consist of.
template <class Bound>
double MovingMesh::over_triangulations(std::uint32_t face, Bound&& bound) const {
  const auto corner = corners_of(face);
  const std::vector<VertexState>& states = trial_;
  double largest = 0;
  for (const auto& [a, b, c] : triangles_of(static_cast<int>(corners_))) {
    const VertexState &p = states[corner[a]], &q = states[corner[b]], &r = states[corner[c]];
    const glm::dvec3 corners[3] = {p.at, q.at, r.at};
    const double bounded = bound(corners, glm::dvec3(p.bound.distance, q.bound.distance, r.bound.distance),
                                 glm::uvec3(p.bound.triangle, q.bound.triangle, r.bound.triangle));
    if (bounded == kUnproved) return kUnproved;
    largest = std::max(largest, bounded);
  }
  return largest;
}

double MovingMesh::reach_by_certificate(std::uint32_t face) const {
  for (const std::uint32_t v : corners_of(face)) {
    if (trial_[v].bound.distance > limit_) return kUnproved;
  }
  // The first question is the one that Certificate asks, so that it proves the face again; then comes the headroom.
  double reach = kUnproved;
  for (const TriangleCertificate& certificate : certificates_) {
    reach =
        over_triangulations(face, [&](const auto&... triangle) { return certificate.bound_in_any_order(triangle...); });
    if (reach <= limit_ || reach == kUnproved) break;
  }
  return reach;
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
    return (trial_reach_[faces[i]] = reach_by_motion(faces[i])) == kUnproved;
  });
  for (std::uint32_t& i : open) i = faces[i];
  measure(open, progress);
  std::vector<std::uint8_t> failed(open.size());
  parallel_for(open.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(progress->fraction());
    for (std::size_t i = begin; i < end; ++i)
      failed[i] = (trial_reach_[open[i]] = reach_by_certificate(open[i])) == kUnproved;
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

bool MovingMesh::try_alone(std::uint32_t vertex, const glm::dvec3& at, std::uint32_t& blame) {
  const VertexState from = trial_[vertex];
  if (at == from.at) return true;
  const PointBound there = bound_at(vertex, at, Aim::ahead);
  const double step = step_[vertex];
  if (there.distance > limit_) return false;
  set_trial(vertex, {at, there});
  const auto faces = ring(vertex);
  thread_local std::vector<double> reach;
  reach.resize(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::size_t place = (i + blame) % faces.size();
    reach[place] = reach_by_motion(faces[place]);
    if (reach[place] == kUnproved) reach[place] = reach_by_certificate(faces[place]);
    if (reach[place] != kUnproved) continue;
    blame = static_cast<std::uint32_t>(place);
    trial_[vertex] = from, step_[vertex] = step;
    return false;
  }
  for (std::size_t i = 0; i < faces.size(); ++i) trial_reach_[faces[i]] = reach[i];
  return true;
}

void MovingMesh::accept(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces) {
  parallel_for(vertices.size(), kBlock, threads_, [&](std::size_t begin, std::size_t end) {
    for (const std::uint32_t v : vertices.subspan(begin, end - begin)) state_[v] = trial_[v], step_[v] = 0;
  });
  parallel_for(faces.size(), kBlock, threads_, [&](std::size_t begin, std::size_t end) {
    for (const std::uint32_t f : faces.subspan(begin, end - begin)) reach_[f] = trial_reach_[f];
  });
}

}  // namespace tolvol
