// SPDX-License-Identifier: GPL-3.0-or-later
// Three steps. (1) Where all have their wish, faces that fail send their vertices back to where they were, in rounds,
// until none fails: this is the paper's reset [Botsch04, §5], but with all vertices moving at once, as the faces of the
// result have to be inside in the state that results and not each for itself. (2) Those vertices start again from as
// far as they would be inside alone, and go back by shares in rounds while faces fail, at the worst to step (1). (3)
// One after the other, they go forward again as far as the faces around them let them; vertices that share no face are
// taken at the same time, a colour of them after the other, so that the result does not depend on threads.
//
// No point of a face is farther from the reference than before by more than the longest step of its corners: this
// settles almost all faces without a question to the reference.
#include "operation/pull_back.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <sstream>
#include <utility>

#include "operation/input.h"
#include "reference/errors.h"
#include "reference/parallel.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// Shares of the provable distance. What is nearer than kEasy is proved by the certificate whatever its shape: its
/// pieces become smaller than the rest. Vertices are first put at kComfort, where pieces of a quarter of the tolerance
/// do.
constexpr double kEasy = 0.98, kComfort = 0.97;
constexpr double kGuess = 0.7;           // of the provable distance: up to here the grid's guess of a distance does
constexpr double kRise = 1.0 / 64;       // what no factor can rise by in the end
constexpr double kShrink = 0.5;          // of a factor, in each round in which a face of the vertex fails
constexpr int kCrossings = 8;            // tries to find where a vertex leaves the volume; a plane takes one
constexpr double kClose = 0.002;         // of the provable distance: near enough to that place
constexpr double kInflate = 0x1p-50;     // rounding of a step's length and of adding it, relative
constexpr std::size_t kBlock = 1024;     // faces or vertices, for work of about 10 ns each, and
constexpr std::size_t kSmallBlock = 32;  // for work of about 1 us each

bool finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

[[noreturn]] void refuse(const std::string& name, std::size_t vertex, const glm::dvec3& p, const char* what) {
  std::ostringstream text;
  text << name << " " << vertex << " " << what << " (" << p.x << ", " << p.y << ", " << p.z << ")";
  throw InvalidInput(text.str());
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

PullBack::PullBack(const ToleranceVolume& volume, const Placement& placement, std::span<const std::uint32_t> faces,
                   int corners, std::size_t vertex_count, unsigned threads)
    : volume_(&volume),
      placement_(placement.in(volume.frame())),
      faces_(faces),
      corners_(static_cast<std::size_t>(corners)),
      threads_(threads) {
  if (corners < 1 || corners > 4) throw InvalidInput("a face must have 1 to 4 corners; triangulate larger ones");
  if (faces.size() % corners_ != 0) throw InvalidInput("the face array is not a whole number of faces");
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i] >= vertex_count) {
      throw InvalidInput("face " + std::to_string(i / corners_) + " uses vertex " + std::to_string(faces[i]) +
                         ", but there are only " + std::to_string(vertex_count));
    }
  }
  make_rings(vertex_count);
}

void PullBack::make_rings(std::size_t vertex_count) {
  ring_start_.assign(vertex_count + 1, 0);
  const auto each_use = [&](auto&& use) {
    for (std::uint32_t f = 0; f < faces_.size() / corners_; ++f) {
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

PullBack::Start PullBack::start(std::span<const glm::dvec3> stored, Progress* progress) {
  std::vector<glm::dvec3> extremes;  // what mapping errors are judged by
  for (std::uint32_t v = 0; v < stored.size(); ++v) {
    if (!finite(stored[v])) refuse("vertex", v, stored[v], "is not finite");
    if (!ring(v).empty()) extremes.push_back(stored[v]);
  }
  Start result{{}, storage_warning(*volume_, placement_, extremes)};
  // Vertices may end up anywhere in the volume. The error grows no faster than the distance, so that twice the volume
  // leaves no room for a point that only seems to be in it.
  const double reach = 2 * (1 + volume_->frame_tolerance());
  for (int corner = 0; corner < 8; ++corner) {
    extremes.push_back(
        placement_.store(reach * glm::dvec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1)));
  }
  const double mapping_error = placement_.mapping_error(extremes);
  provable_ = volume_->provable(mapping_error);
  within_ = provable_ * (1 - kHeadroom);
  certificates_.clear();
  for (const double within : {provable_, within_}) {
    certificates_.emplace_back(volume_->witnesses(), volume_->grid(), volume_->hierarchy(), within,
                               volume_->refutable(mapping_error));
  }

  state_.resize(stored.size());
  if (progress) progress->begin("checking");
  const std::size_t offender = first_of(stored.size(), threads_, [&](std::size_t v) {
    state_[v] = {placement_.frame(stored[v]), kUnknown};
    return !finite(state_[v].at) && !ring(static_cast<std::uint32_t>(v)).empty();
  });
  if (offender < stored.size()) {
    refuse("vertex", offender, stored[offender], "is too far away for double precision");
  }
  trial_ = state_;
  step_.assign(stored.size(), 0);
  held_index_.assign(stored.size(), kNone);
  frozen_.assign(stored.size(), false);
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
      reach_[f] = provable_;  // nothing is known of it beyond the state as it is
      outside[i] = over_triangulations(f, [&](const glm::dvec3(&corners)[3], const glm::dvec3& distances) {
                     return certificates_.front().verdict(corners, distances) == Verdict::inside ? 0 : kUnproved;
                   }) == kUnproved;
    }
  });
  result.outside = chosen(open, outside);
  for (const std::uint32_t f : result.outside) {
    for (const std::uint32_t v : corners_of(f)) frozen_[v] = true;
  }
  any_frozen_ = !result.outside.empty();
  return result;
}

/// Whether the face is the face of that number of the reference.
bool PullBack::is_own(std::uint32_t face) const {
  const TriangleMesh& reference = volume_->reference();
  if (corners_ != 3 || face >= reference.triangles.size()) return false;
  for (int k = 0; k < 3; ++k) {
    if (state_[corners_of(face)[k]].at != reference.vertices[reference.triangles[face][k]]) return false;
  }
  return true;
}

PullBack::Moving PullBack::moving(std::vector<std::uint32_t> vertices) {
  Moving result{std::move(vertices), {}};
  result.faces = faces_around(result.vertices);
  return result;
}

/// Each once.
std::vector<std::uint32_t> PullBack::faces_around(std::span<const std::uint32_t> vertices) {
  ++now_;
  std::vector<std::uint32_t> faces;
  for (const std::uint32_t v : vertices) {
    for (const std::uint32_t f : ring(v)) {
      if (std::exchange(seen_[f], now_) != now_) faces.push_back(f);
    }
  }
  return faces;
}

/// An upper bound; the distance itself where the grid's guess leaves little room.
double PullBack::distance_of(const glm::dvec3& at) const {
  const double box = 1 + 2 * volume_->frame_tolerance();
  // Written so that NaN is outside.
  if (!(std::abs(at.x) <= box && std::abs(at.y) <= box && std::abs(at.z) <= box)) return kFar;
  const double guess = certificates_.front().distance_bound(at);
  if (guess <= kGuess * within_) return guess;
  const Hierarchy::Nearest nearest = volume_->hierarchy().nearest(at, provable_, volume_->grid().triangle_near(at));
  return nearest.triangle == Hierarchy::kNone ? kFar : nearest.distance;
}

double PullBack::reach_by_motion(std::uint32_t face) const {
  double step = 0;
  for (const std::uint32_t v : corners_of(face)) step = std::max(step, step_[v]);
  if (step == 0) return reach_[face];
  const double reach = (reach_[face] + step) * (1 + kInflate);
  return reach <= kEasy * within_ ? reach : kUnproved;
}

/// The largest of bound(corners, distances) over the triangles that the face may consist of.
template <class Bound>
double PullBack::over_triangulations(std::uint32_t face, Bound&& bound) const {
  const auto corner = corners_of(face);
  const std::vector<Spot>& spots = trial_;
  const auto triangle = [&](int a, int b, int c) {
    const Spot &p = spots[corner[a]], &q = spots[corner[b]], &r = spots[corner[c]];
    return bound({p.at, q.at, r.at}, glm::dvec3(p.distance, q.distance, r.distance));
  };
  switch (corners_) {
    case 1:
      return triangle(0, 0, 0);
    case 2:
      return triangle(0, 1, 1);
    case 3:
      return triangle(0, 1, 2);
    default: {
      double largest = 0;
      for (const glm::ivec3& t : {glm::ivec3(0, 1, 2), glm::ivec3(0, 2, 3), glm::ivec3(0, 1, 3), glm::ivec3(1, 2, 3)}) {
        if (largest != kUnproved) largest = std::max(largest, triangle(t.x, t.y, t.z));
      }
      return largest;
    }
  }
}

double PullBack::reach_by_certificate(std::uint32_t face) const {
  for (const std::uint32_t v : corners_of(face)) {
    if (trial_[v].distance > within_) return kUnproved;
  }
  // First as Certificate decides, so that it proves the face again; then the headroom.
  double reach = kUnproved;
  for (const TriangleCertificate& certificate : certificates_) {
    reach = over_triangulations(face, [&](const glm::dvec3(&corners)[3], const glm::dvec3& distances) {
      return certificate.bound(corners, distances);
    });
    if (reach <= within_ || reach == kUnproved) break;
  }
  return reach;
}

/// Sees to it that the distances of all corners are known.
void PullBack::measure(std::span<const std::uint32_t> faces, Progress* progress) {
  std::vector<std::uint32_t> unknown;
  for (const std::uint32_t f : faces) {
    for (const std::uint32_t v : corners_of(f)) {
      if (trial_[v].distance != kUnknown) continue;
      trial_[v].distance = kFar;  // once each
      unknown.push_back(v);
    }
  }
  parallel_for(unknown.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    if (progress) progress->update(progress->fraction());
    for (std::size_t i = begin; i < end; ++i) trial_[unknown[i]].distance = distance_of(trial_[unknown[i]].at);
  });
}

/// Which of these faces are not inside as their corners are now tried; writes trial_reach_ of all.
std::vector<std::uint32_t> PullBack::failing(std::span<const std::uint32_t> faces, Progress* progress) {
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

PullBack::Result PullBack::move(const Moving& moving, std::span<const glm::dvec3> before,
                                std::span<const glm::dvec3> after, Mode mode, Progress* progress) {
  const std::vector<std::uint32_t>& vertices = moving.vertices;
  const auto each = [&](auto&& body) {
    parallel_for(vertices.size(), kBlock, threads_, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) body(i, vertices[i]);
    });
  };
  const std::size_t offender = first_of(vertices.size(), threads_, [&](std::size_t i) {
    const std::uint32_t v = vertices[i];
    if (frozen_[v]) return !finite(after[i]);
    trial_[v] = {placement_.frame(after[i]), kUnknown};
    step_[v] = glm::length(trial_[v].at - state_[v].at);
    return !finite(after[i] - before[i]) || !finite(trial_[v].at);
  });
  if (offender < vertices.size()) {
    each([&](std::size_t, std::uint32_t v) { trial_[v] = state_[v], step_[v] = 0; });
    refuse("the wish for vertex", vertices[offender], after[offender],
           finite(after[offender]) ? "is too far away for double precision" : "is not finite");
  }

  Result result{std::vector<double>(vertices.size(), 1), {after.begin(), after.end()}, 0};
  std::vector<std::uint32_t> failed = failing(moving.faces, progress);
  if (!failed.empty()) {
    std::vector<Held> held = hold(moving, before, after, std::move(failed), progress);
    if (mode != Mode::reset) {
      pull(held, progress);
      if (mode != Mode::halve) let_go(held, mode, progress);
    }
    for (const Held& h : held) {
      const auto place = std::lower_bound(vertices.begin(), vertices.end(), h.vertex) - vertices.begin();
      result.factors[place] = h.factor;
      result.reached[place] = stored_at(h, h.factor);
      result.held_back += h.factor < 1;
      held_index_[h.vertex] = kNone;
    }
  }
  for (std::size_t i = 0; any_frozen_ && i < vertices.size(); ++i) {
    if (!frozen_[vertices[i]]) continue;
    result.factors[i] = 0, result.reached[i] = before[i];
    ++result.held_back;
  }
  each([&](std::size_t, std::uint32_t v) { state_[v] = trial_[v], step_[v] = 0; });
  parallel_for(moving.faces.size(), kBlock, threads_, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) reach_[moving.faces[i]] = trial_reach_[moving.faces[i]];
  });
  return result;
}

/// Step (1). Ends, because a face that fails has a corner away from the state, in which it did not fail.
std::vector<PullBack::Held> PullBack::hold(const Moving& moving, std::span<const glm::dvec3> before,
                                           std::span<const glm::dvec3> after, std::vector<std::uint32_t> failed,
                                           Progress* progress) {
  std::vector<Held> held;
  std::vector<std::uint32_t> back;
  for (; !failed.empty(); failed = failing(faces_around(back), progress)) {
    back.clear();
    for (const std::uint32_t f : failed) {
      for (const std::uint32_t v : corners_of(f)) {
        if (step_[v] == 0) continue;
        const auto place =
            std::lower_bound(moving.vertices.begin(), moving.vertices.end(), v) - moving.vertices.begin();
        held.push_back({v, before[place], after[place], step_[v]});
        trial_[v] = state_[v], step_[v] = 0;
        back.push_back(v);
      }
    }
  }
  std::sort(held.begin(), held.end(), [](const Held& a, const Held& b) { return a.vertex < b.vertex; });
  for (std::uint32_t i = 0; i < held.size(); ++i) held_index_[held[i].vertex] = i;
  return held;
}

glm::dvec3 PullBack::stored_at(const Held& held, double factor) const {
  if (factor >= 1) return held.after;
  if (factor <= 0) return held.before;
  const glm::dvec3 p = held.before + factor * (held.after - held.before);
  return placement_.storage() == Storage::float32 ? rounded_to_float32(p) : p;
}

void PullBack::place(const Held& held, double factor) {
  const std::uint32_t v = held.vertex;
  trial_[v] = {placement_.frame(stored_at(held, factor)), kUnknown};
  step_[v] = glm::length(trial_[v].at - state_[v].at);
}

/// A factor at which the vertex itself is about `target` from the reference, at the most, between one where it is
/// nearer and one where it is farther: false position, in which an end that stays twice counts half (Illinois).
double PullBack::crossing(const Held& held, double target, Along near, Along far) const {
  double near_excess = near.distance - target, far_excess = far.distance - target;
  for (int i = 0; i < kCrossings && near_excess < -kClose * within_; ++i) {
    const double factor = near.factor + (far.factor - near.factor) * near_excess / (near_excess - far_excess);
    const Along next = along(held, factor, far.triangle);
    if (next.distance <= target) {
      near = next, near_excess = next.distance - target, far_excess /= 2;
    } else {
      far = next, far_excess = next.distance - target, near_excess /= 2;
    }
  }
  return near.factor;
}

PullBack::Along PullBack::along(const Held& held, double factor, std::uint32_t hint) const {
  const glm::dvec3 at = placement_.frame(stored_at(held, factor));
  const std::uint32_t guess = volume_->grid().triangle_near(at);
  const Hierarchy::Nearest nearest = volume_->hierarchy().nearest(at, std::numeric_limits<double>::infinity(),
                                                                  guess == DistanceGrid::kNone ? hint : guess);
  return {factor, nearest.distance, nearest.triangle};
}

/// Finds where the vertex leaves the volume if nothing else held it, and puts it a little before that.
void PullBack::release(Held& held) {
  // A wish at the end of the world tells nothing: all of the volume is in this box.
  const double box = 1 + 2 * volume_->frame_tolerance();
  const glm::dvec3 from = state_[held.vertex].at, way = placement_.frame(held.after) - from;
  double exit = 1;
  for (int k = 0; k < 3; ++k) {
    if (way[k] != 0) exit = std::min(exit, std::max(0.0, (std::copysign(box, way[k]) - from[k]) / way[k]));
  }
  const Along far = along(held, exit, kNone), near = along(held, 0, far.triangle);
  held.factor = held.limit = 1;
  if (far.distance > within_) {
    held.limit = near.distance < within_ ? crossing(held, within_, near, far) : 0;
    held.factor = near.distance < kComfort * within_ ? crossing(held, kComfort * within_, near, far) : 0;
  }
  place(held, held.factor);
}

/// Step (2).
void PullBack::pull(std::vector<Held>& held, Progress* progress) {
  parallel_for(held.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) release(held[i]);
  });
  std::vector<std::uint32_t> changed;
  for (const Held& h : held) changed.push_back(h.vertex);
  for (;;) {
    const std::vector<std::uint32_t> failed = failing(faces_around(changed), progress);
    if (failed.empty()) return;
    changed.clear();
    for (const std::uint32_t f : failed) {
      for (const std::uint32_t v : corners_of(f)) {
        if (held_index_[v] != kNone && held[held_index_[v]].factor > 0) changed.push_back(v);
      }
    }
    std::sort(changed.begin(), changed.end());
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    for (const std::uint32_t v : changed) {
      Held& h = held[held_index_[v]];
      h.factor *= kShrink;
      if (h.factor * h.length < (1 - kComfort) * within_) h.factor = 0;
      place(h, h.factor);
    }
  }
}

template <class Visit>
void PullBack::held_around(std::uint32_t vertex, Visit&& visit) const {
  for (const std::uint32_t f : ring(vertex)) {
    for (const std::uint32_t v : corners_of(f)) {
      if (v != vertex && held_index_[v] != kNone) visit(held_index_[v]);
    }
  }
}

/// Greedy, in the order of the vertices: no two of a colour share a face. Returns how many colours there are.
std::uint32_t PullBack::colour(std::vector<Held>& held) const {
  std::vector<std::uint32_t> taken;  // by colour: the last vertex that has a neighbour of it
  for (std::uint32_t i = 0; i < held.size(); ++i) {
    held_around(held[i].vertex, [&](std::uint32_t other) {
      if (other < i) taken[held[other].colour] = i;
    });
    std::uint32_t& colour = held[i].colour;
    colour = 0;
    while (colour < taken.size() && taken[colour] == i) ++colour;
    if (colour == taken.size()) taken.push_back(kNone);
  }
  return static_cast<std::uint32_t>(taken.size());
}

/// Step (3). Ends, because from its second turn on a vertex goes forward by kRise or not at all.
void PullBack::let_go(std::vector<Held>& held, Mode mode, Progress* progress) {
  std::vector<std::uint32_t> around;
  std::vector<std::vector<std::uint32_t>> due(colour(held));
  for (std::uint32_t i = 0; i < held.size(); ++i) {
    due[held[i].colour].push_back(i);
    around.push_back(held[i].vertex);
  }
  measure(faces_around(around), progress);
  std::vector<bool> is_due(held.size(), true), searched(held.size(), false);
  std::vector<std::uint8_t> raised;
  for (bool any = true; any;) {
    any = false;
    for (std::vector<std::uint32_t>& list : due) {
      const std::vector<std::uint32_t> turn = std::exchange(list, {});
      any = any || !turn.empty();
      raised.assign(turn.size(), 0);
      parallel_for(turn.size(), kSmallBlock, threads_, [&](std::size_t begin, std::size_t end) {
        if (progress) progress->update(progress->fraction());
        for (std::size_t i = begin; i < end; ++i) {
          Held& h = held[turn[i]];
          const double factor = h.factor;
          raise(h, mode, !searched[turn[i]]);
          raised[i] = h.factor > factor;
        }
      });
      for (const std::uint32_t i : turn) is_due[i] = false, searched[i] = true;
      for (std::size_t i = 0; i < turn.size(); ++i) {
        if (!raised[i]) continue;
        held_around(held[turn[i]].vertex, [&](std::uint32_t other) {
          if (is_due[other] || held[other].factor >= 1) return;
          is_due[other] = true;
          due[held[other].colour].push_back(other);
        });
      }
    }
  }
}

void PullBack::raise(Held& held, Mode mode, bool search) {
  const double little = (1 - kComfort) * within_ / held.length;
  const double rise = mode == Mode::settle ? std::max(kRise, little) : kRise, grain = std::min(rise, little);
  while (held.factor < 1) {
    if (held.limit >= 1 && attempt(held, 1)) return;
    if (search) {
      // Most are held back by nothing but their own limit: just below it first.
      double lower = held.factor, upper = std::min(1.0, held.limit), next = upper - grain / 2;
      while (upper - lower > grain) {
        (attempt(held, next) ? lower : upper) = next;
        next = (lower + upper) / 2;
      }
    }
    if (!attempt(held, std::min(1.0, held.factor + rise))) return;
    search = true;
  }
}

/// Puts the vertex there if all faces around it are then inside.
bool PullBack::attempt(Held& held, double factor) {
  const std::uint32_t v = held.vertex;
  const Spot from{trial_[v]}, to{placement_.frame(stored_at(held, factor)), 0};
  if (to.at == from.at) {
    held.factor = factor;
    return true;
  }
  const double distance = distance_of(to.at), step = step_[v];
  if (distance > within_) return false;
  trial_[v] = {to.at, distance};
  step_[v] = glm::length(to.at - state_[v].at);
  const auto faces = ring(v);
  thread_local std::vector<double> reach;
  reach.resize(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const std::size_t place = (i + held.blame) % faces.size();
    reach[place] = reach_by_motion(faces[place]);
    if (reach[place] == kUnproved) reach[place] = reach_by_certificate(faces[place]);
    if (reach[place] != kUnproved) continue;
    held.blame = static_cast<std::uint32_t>(place);
    trial_[v] = from, step_[v] = step;
    return false;
  }
  for (std::size_t i = 0; i < faces.size(); ++i) trial_reach_[faces[i]] = reach[i];
  held.factor = factor;
  return true;
}

}  // namespace tolvol
