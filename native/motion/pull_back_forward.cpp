// SPDX-License-Identifier: GPL-3.0-or-later
// Steps (2) and (3) of pull_back.cpp: from where each vertex would leave the volume alone back to where its faces are
// inside, and forward again as far as they let it.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/parallel.h"
#include "motion/pull_back.h"
#include "motion/selection.h"

namespace tolvol {
namespace {

/// Vertices are first put at this share of the provable distance, because there parts of a quarter of the tolerance
/// prove a face.
constexpr double kComfort = 0.97;
/// In Mode::settle, a vertex that has reached this share of the provable distance stays there, unless it is still
/// inside after a further way of the share kLast of the same distance.
constexpr double kSettled = 0.965, kLast = 0.04;
/// A search for the place where a vertex leaves the volume takes at most this many tries. At a plane it takes one.
constexpr int kLeavingTries = 8;
/// This search ends within this share of the provable distance.
constexpr double kClose = 0.002;

}  // namespace

/// Finds a place where the vertex itself is about `target` from the reference, at the most, between a place where it is
/// nearer and one where it is farther. The method is false position in which an end that stays twice counts half
/// (Illinois).
PullBack::Along PullBack::leaving_point(const Held& held, double target, Along inner, Along outer) const {
  const double close = kClose * mesh_.limit(), aim = target - close / 2;
  double inner_excess = inner.bound.distance - aim, outer_excess = outer.bound.distance - aim;
  bool was_outside = false;
  for (int i = 0; i < kLeavingTries && inner.bound.distance < target - close; ++i) {
    const double factor = inner.factor + (outer.factor - inner.factor) * inner_excess / (inner_excess - outer_excess);
    const Along next = along(held, factor, inner.bound.triangle);
    const bool outside = !(next.bound.distance <= target), stays_twice = i > 0 && was_outside == outside;
    (outside ? outer : inner) = next;
    (outside ? outer_excess : inner_excess) = next.bound.distance - aim;
    if (stays_twice) (outside ? inner_excess : outer_excess) /= 2;
    was_outside = outside;
  }
  return inner;
}

/// Returns the place at this factor of the vertex's way, and its distance from the reference, without a limit of
/// distance.
PullBack::Along PullBack::along(const Held& held, double factor, std::uint32_t hint) const {
  const glm::dvec3 at = mesh_.space().frame(stored_at(held, factor));
  if (hint == Hierarchy::kNone) hint = mesh_.volume().grid().triangle_near(at);
  const Hierarchy::Nearest nearest =
      mesh_.volume().hierarchy().nearest(at, std::numeric_limits<double>::infinity(), hint);
  return {factor, {nearest.distance, nearest.triangle}};
}

/// Finds where the vertex leaves the volume if nothing else held it, and puts it a little before that.
void PullBack::release(Held& held, Mode mode) {
  const double limit = mesh_.limit();
  if (held.wish.distance <= limit) {
    held.largest_factor = 1;
    return place(held, {1, held.wish});
  }
  // A wish far away is replaced by a place on its way at this box, in which all of the volume is.
  const double box = 1 + 2 * mesh_.volume().frame_tolerance();
  const glm::dvec3 from = mesh_.state(held.vertex), way = mesh_.space().frame(held.after) - from;
  double exit = 1;
  for (int k = 0; k < 3; ++k) {
    if (way[k] != 0) exit = std::min(exit, std::max(0.0, (std::copysign(box, way[k]) - from[k]) / way[k]));
  }
  Along start{0, mesh_.bound_of_state(held.vertex)};
  if (!mesh_.is_exact(start.bound)) start = along(held, 0, start.bound.triangle);
  Along inner = start;
  held.largest_factor = 0;
  const double comfort = mode == Mode::settle ? kSettled : kComfort;
  if (mode == Mode::settle && !(start.bound.distance < kSettled * limit)) {
    const double factor = std::min(kLast * limit / held.length, exit);
    const glm::dvec3 ahead = mesh_.space().frame(stored_at(held, factor));
    inner = {factor, mesh_.bound_at(held.vertex, ahead, MovingMesh::Aim::ahead)};
    if (inner.bound.distance > limit) return place(held, start);
  }
  const bool known = exit == 1 && held.wish.triangle != Hierarchy::kNone;
  const Along outer = known ? Along{1, held.wish} : along(held, exit, inner.bound.triangle);
  Along end = start;
  if (inner.bound.distance < comfort * limit) end = leaving_point(held, kComfort * limit, inner, outer);
  if (mode == Mode::settle && end.factor > 0) {
    held.largest_factor = end.factor;
  } else if (mode != Mode::halve && inner.bound.distance < limit) {
    held.largest_factor = leaving_point(held, limit, end.factor > 0 ? end : inner, outer).factor;
  }
  place(held, end);
}

/// Does step (2).
void PullBack::pull(std::vector<Held>& held, Mode mode, Progress* progress) {
  parallel_for(held.size(), kFewAtOnce, mesh_.threads(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) release(held[i], mode);
  });
  std::vector<std::uint32_t> changed;
  for (const Held& h : held) {
    if (h.factor > 0) changed.push_back(h.vertex);
  }
  for (;;) {
    const std::vector<std::uint32_t> failed = mesh_.failing(mesh_.faces_around(changed), progress);
    if (failed.empty()) return;
    changed.clear();
    for (const std::uint32_t f : failed) {
      for (const std::uint32_t v : mesh_.corners_of(f)) {
        if (held_index_[v] != kNone && held[held_index_[v]].factor > 0) changed.push_back(v);
      }
    }
    if (changed.empty()) throw std::logic_error("a state that was inside no longer is");
    std::sort(changed.begin(), changed.end());
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    for (const std::uint32_t v : changed) {
      Held& h = held[held_index_[v]];
      h.factor *= kShrink;
      if (h.factor < little(h)) h.factor = 0;
      h.factor > 0 ? place(h, {h.factor, {}}) : mesh_.take_back(v);
    }
  }
}

template <class Visit>
void PullBack::held_around(std::uint32_t vertex, Visit&& visit) const {
  for (const std::uint32_t f : mesh_.ring(vertex)) {
    for (const std::uint32_t v : mesh_.corners_of(f)) {
      if (v != vertex && held_index_[v] != kNone) visit(held_index_[v]);
    }
  }
}

/// Colours the vertices greedily in their order, so that no two of a colour share a face. Returns the number of
/// colours.
std::uint32_t PullBack::colour(std::vector<Held>& held) const {
  std::vector<std::uint32_t> taken;  // For each colour: the last vertex that has a neighbour of it.
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

/// Does step (3). It ends, because from its second turn on a vertex goes forward by kRise or not at all.
void PullBack::let_go(std::vector<Held>& held, Mode mode, Progress* progress) {
  const auto settled = [&](const Held& h) { return h.factor >= (mode == Mode::settle ? h.largest_factor : 1); };
  std::vector<std::uint32_t> around;
  std::vector<std::vector<std::uint32_t>> due(colour(held));
  for (std::uint32_t i = 0; i < held.size(); ++i) {
    if (settled(held[i])) continue;
    due[held[i].colour].push_back(i);
    around.push_back(held[i].vertex);
  }
  mesh_.measure(mesh_.faces_around(around), progress);
  std::vector<bool> is_due(held.size(), true), searched(held.size(), false);
  std::vector<std::uint8_t> raised;
  for (bool any = true; any;) {
    any = false;
    for (std::vector<std::uint32_t>& list : due) {
      const std::vector<std::uint32_t> turn = std::exchange(list, {});
      any = any || !turn.empty();
      raised.assign(turn.size(), 0);
      parallel_for(turn.size(), kFewAtOnce, mesh_.threads(), [&](std::size_t begin, std::size_t end) {
        if (progress) progress->poll();
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
          if (is_due[other] || settled(held[other])) return;
          is_due[other] = true;
          due[held[other].colour].push_back(other);
        });
      }
    }
  }
}

bool PullBack::attempt(Held& held, double factor) {
  if (!mesh_.try_alone(held.vertex, mesh_.space().frame(stored_at(held, factor)), held.blame)) return false;
  held.factor = factor;
  return true;
}

/// The share of the motion that is as long as what is beyond kComfort.
double PullBack::little(const Held& held) const { return (1 - kComfort) * mesh_.limit() / held.length; }

void PullBack::raise(Held& held, Mode mode, bool search) {
  const double step = mode == Mode::settle ? std::max(kRise, little(held)) : kRise;
  const double grain = std::min(step, little(held));
  while (held.factor < 1) {
    if (held.largest_factor >= 1 && attempt(held, 1)) return;
    if (search) {
      // A vertex that nothing holds back but its own limit ends just below it.
      double lower = held.factor, upper = std::min(1.0, held.largest_factor), next = upper - grain / 2;
      while (upper - lower > grain) {
        (attempt(held, next) ? lower : upper) = next;
        next = (lower + upper) / 2;
      }
    }
    if (!attempt(held, std::min(1.0, held.factor + step))) return;
    search = true;
  }
}

}  // namespace tolvol
