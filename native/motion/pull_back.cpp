// SPDX-License-Identifier: GPL-3.0-or-later
// Three steps. (1) Where all have their wish, faces that fail send their vertices back to where they were, in rounds,
// until none fails: this is the paper's reset [Botsch04, §5], but with all vertices moving at once, as the faces of the
// result have to be inside in the state that results and not each for itself. (2) Those vertices start again from as
// far as they would be inside alone, and go back by shares in rounds while faces fail, at the worst to step (1). (3)
// One after the other, they go forward again as far as the faces around them let them; vertices that share no face are
// taken at the same time, a colour of them after the other, so that the result does not depend on threads.
//
// There is a fourth step: while the reference would lose faces as witnesses, or faces would cross that did not at the
// start, the vertices of these faces go back, by a small share of the way first. What goes back may uncover a part of
// the reference that it covered, leave the volume as its neighbours go on, or meet another face, so that all is asked
// again until all of it holds. In the state itself all of it does, so that this comes to an end.
#include "motion/pull_back.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "base/call.h"
#include "base/errors.h"
#include "base/parallel.h"
#include "check/input_checks.h"
#include "geometry/triangle_mesh.h"
#include "motion/moving_coverage.h"
#include "motion/moving_crossings.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

/// In the end no factor can rise by this.
constexpr double kRise = 1.0 / 64;
/// A factor shrinks to this share in each round in which a face of the vertex fails.
constexpr double kShrink = 0.5;
/// Where the reference would lose a witness or faces would cross, a factor shrinks by this share first, then by twice
/// the share each time, and after half of it by kShrink.
constexpr double kRetreat = 1.0 / 16;
/// Where vertices went back for crossings so many times and faces still cross, they go all the way back, together with
/// more and more rings of vertices around them: far from where they were, faces that stay in the way of others meet
/// them one after the other.
constexpr std::size_t kPatience = 64;
/// The share of the provable distance at which vertices are put first, because parts of a quarter of the tolerance
/// prove a face there.
constexpr double kComfort = 0.97;
/// In Mode::settle, a vertex that has reached this share of the provable distance stays there, unless it is still
/// inside after a further way of the share kLast of the same distance.
constexpr double kSettled = 0.965, kLast = 0.04;
/// The number of tries to find where a vertex leaves the volume; a plane takes one.
constexpr int kLeavingTries = 8;
/// The search ends within this share of the provable distance.
constexpr double kClose = 0.002;
/// The number of vertices that a thread takes at a time, for work of a few us each.
constexpr std::size_t kBlock = 32;

}  // namespace

PullBack::PullBack(const ToleranceVolume& volume, const StoredSpace& space, std::span<const std::uint32_t> faces,
                   int corners, std::size_t vertex_count, unsigned threads)
    : mesh_(volume, space, faces, corners, vertex_count, threads), held_index_(vertex_count, kNone) {}

PullBack::~PullBack() = default;

PullBack::Start PullBack::start(std::span<const glm::dvec3> stored, const StartOptions& options, Progress* progress) {
  if (options.two_sided) require_area_to_cover(mesh_.corners());
  held_index_.assign(stored.size(), kNone);
  next_twin_.clear();
  coverage_.reset(), crossings_.reset();
  std::vector<std::uint32_t> place;
  if (options.together) place = weld_equal_positions(stored);
  MovingMesh::Start start = mesh_.start(stored, options.max_normal_angle, place, progress);
  if (!start.outside.empty() && options.outside == Outside::error) refuse_outside(FaceCount::of(start.outside));
  Start result{std::move(start.outside), {}, FaceCount::of(mesh_.exceeding()), std::move(start.warnings)};
  if (options.together) {
    link_twins(place);
    if (const auto warning = mesh_.hold_t_junctions(stored, place)) result.warnings.push_back(*warning);
  }
  if (options.crossings == Crossings::keep_out && mesh_.corners() >= 3) {
    crossings_ = std::make_unique<MovingCrossings>(mesh_.faces(), mesh_.corners(), stored, mesh_.threads());
    if (options.short_ways && mesh_.corners() == 3) crossings_->skip_short_ways(mesh_);
  }
  if (!options.two_sided) return result;
  coverage_ = std::make_unique<MovingCoverage>(mesh_, progress);
  result.uncovered = coverage_->uncovered();
  if (result.uncovered.faces) result.warnings.push_back(take_uncovered(result.uncovered, options.outside));
  return result;
}

PullBack::Moving PullBack::moving(std::vector<std::uint32_t> vertices) {
  Moving result{std::move(vertices), {}};
  result.faces = mesh_.faces_around(result.vertices);
  return result;
}

PullBack::Result PullBack::move(const Moving& moving, std::span<const glm::dvec3> before,
                                std::span<const glm::dvec3> after, Mode mode, Progress* progress) {
  if (coverage_) coverage_->tidy();
  if (crossings_) crossings_->tidy();
  mesh_.try_all(moving.vertices, before, after);
  try {
    return finish({moving, before, after}, mode, progress);
  } catch (...) {
    for (const std::uint32_t v : moving.vertices) mesh_.take_back(v), held_index_[v] = kNone;
    if (crossings_) crossings_->take_back(moving.vertices, moving.faces);
    throw;
  }
}

/// Moves the vertices from the wish, which is on trial, to where they may stay, and accepts that.
PullBack::Result PullBack::finish(const Wish& wish, Mode mode, Progress* progress) {
  const auto& [moving, before, after] = wish;
  const std::vector<std::uint32_t>& vertices = moving.vertices;
  Result result{std::vector<double>(vertices.size(), 1), {after.begin(), after.end()}};
  if (mode == Mode::settle) mesh_.remember_refusals();
  std::vector<std::uint32_t> failed = mesh_.failing(moving.faces, progress);
  std::vector<Held> held;
  if (!failed.empty()) {
    held = hold(wish, std::move(failed), progress);
    if (mode != Mode::reset) {
      pull(held, mode, progress);
      if (mode != Mode::halve) let_go(held, mode, progress);
    }
  }
  back_off(held, wish, mode, progress);
  for (const Held& h : held) {
    const auto place = std::lower_bound(vertices.begin(), vertices.end(), h.vertex) - vertices.begin();
    result.factors[place] = h.factor;
    result.reached[place] = stored_at(h, h.factor);
    result.held_back += h.factor < 1;
    result.kept_from_crossing += h.kept_from_crossing && h.factor < 1;
    held_index_[h.vertex] = kNone;
  }
  for (std::size_t i = 0; mesh_.any_frozen() && i < vertices.size(); ++i) {
    if (!mesh_.frozen(vertices[i])) continue;
    result.factors[i] = 0, result.reached[i] = before[i];
    ++result.held_back;
  }
  if (coverage_) coverage_->accept(moving.faces);
  mesh_.accept(vertices, moving.faces);
  if (crossings_) crossings_->accept(vertices);
  return result;
}

/// Puts a moving vertex among those that are held.
PullBack::Held& PullBack::hold(std::uint32_t vertex, const Wish& wish, std::vector<Held>& held) {
  const std::vector<std::uint32_t>& vertices = wish.moving.vertices;
  const auto place = std::lower_bound(vertices.begin(), vertices.end(), vertex) - vertices.begin();
  held_index_[vertex] = static_cast<std::uint32_t>(held.size());
  held.push_back({vertex, wish.before[place], wish.after[place], mesh_.bound_of_trial(vertex), mesh_.step(vertex)});
  return held.back();
}

/// Does step (1). It ends, because a face that fails has a corner away from the state, in which it did not fail.
std::vector<PullBack::Held> PullBack::hold(const Wish& wish, std::vector<std::uint32_t> failed, Progress* progress) {
  std::vector<Held> held;
  std::vector<std::uint32_t> back;
  for (; !failed.empty(); failed = mesh_.failing(mesh_.faces_around(back), progress)) {
    back.clear();
    for (const std::uint32_t f : failed) {
      for (const std::uint32_t v : mesh_.corners_of(f)) {
        if (mesh_.step(v) == 0) continue;
        hold(v, wish, held);
        mesh_.take_back(v);
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
  return mesh_.space().storage() == Storage::float32 ? rounded_to_float32(p) : p;
}

void PullBack::place(Held& held, const Along& along) {
  held.factor = along.factor;
  mesh_.try_at(held.vertex, mesh_.space().frame(stored_at(held, along.factor)), along.bound);
}

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

/// A place on the way, and the distance there, however far it is.
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
  parallel_for(held.size(), kBlock, mesh_.threads(), [&](std::size_t begin, std::size_t end) {
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
      parallel_for(turn.size(), kBlock, mesh_.threads(), [&](std::size_t begin, std::size_t end) {
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

/// Does step (4). It ends: a face that fails has a corner away from the state, or crosses a face that has one, because
/// nothing fails in the state. All of these corners go back, and a vertex is back in the state after some rounds in
/// which a face of it fails. A vertex that no step before has held goes back from its wish.
void PullBack::back_off(std::vector<Held>& held, const Wish& wish, Mode mode, Progress* progress) {
  if (crossings_) start_crossings(held, wish);
  // Crossings are looked for among the faces whose corners have moved since they were last.
  std::vector<std::uint32_t> changed, lost, untested = wish.moving.faces, since, again;
  bool is_renewed = false;
  std::size_t rounds = 0;
  if (!next_twin_.empty()) hold_twins(wish, wish.moving.vertices, held, changed);
  for (;;) {
    // A face may fail because some of its corners went back and others did not.
    std::vector<std::uint32_t> failed = mesh_.failing(mesh_.faces_around(changed), progress);
    if (failed.empty() && coverage_) {
      if (!lost.empty()) lost = coverage_->still_failing(lost);
      if (lost.empty()) lost = coverage_->failing(wish.moving.faces);
      if (!lost.empty() && !is_renewed && coverage_->is_worn()) {
        is_renewed = true;
        coverage_->renew();
        lost = coverage_->failing(wish.moving.faces);
      }
      failed = lost;
    }
    const bool cross = failed.empty() && crossings_;
    if (cross) {
      if (rounds > 0) {
        // A face that crosses very many is not returned with all of them, and may be back in the state by now.
        untested = mesh_.faces_around(since);
        untested.insert(untested.end(), again.begin(), again.end());
        std::sort(untested.begin(), untested.end());
        untested.erase(std::unique(untested.begin(), untested.end()), untested.end());
      }
      failed = crossings_->failing(untested, progress);
      again = failed;
      since.clear();
      ++rounds;
    }
    if (failed.empty()) return;
    changed.clear();
    for (const std::uint32_t f : failed) {
      for (const std::uint32_t v : mesh_.corners_of(f)) {
        if (is_away(v)) changed.push_back(v);
      }
    }
    if (changed.empty()) throw std::logic_error("faces that do not move would break the promise");
    const bool is_hasty = cross && rounds > kPatience;
    if (is_hasty) widen(changed, std::size_t{1} << std::min<std::size_t>(rounds - kPatience, 30));
    std::sort(changed.begin(), changed.end());
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    for (const std::uint32_t v : changed) {
      if (held_index_[v] == kNone) hold(v, wish, held).factor = 1;
      Held& h = held[held_index_[v]];
      h.kept_from_crossing = h.kept_from_crossing || cross;
      retreat(h, is_hasty ? Mode::reset : mode, cross ? kRise : little(h));
    }
    if (!next_twin_.empty()) hold_twins(wish, std::vector(changed), held, changed);
    if (crossings_) since.insert(since.end(), changed.begin(), changed.end());
  }
}

/// `place` names for each vertex the first one at its position.
void PullBack::link_twins(std::span<const std::uint32_t> place) {
  for (std::uint32_t v = 0; v < place.size(); ++v) {
    if (place[v] == v) continue;
    if (next_twin_.empty()) {
      next_twin_.resize(place.size());
      twin_seen_.assign(place.size(), 0);
      std::iota(next_twin_.begin(), next_twin_.end(), 0u);
    }
    next_twin_[v] = std::exchange(next_twin_[place[v]], v);
  }
}

/// Sends vertices back to where their twins are, the vertices that were at their place at the start and have the same
/// way now: these vertices' twins and the other way round. Adds the vertices that went back to `changed`.
void PullBack::hold_twins(const Wish& wish, std::span<const std::uint32_t> vertices, std::vector<Held>& held,
                          std::vector<std::uint32_t>& changed) {
  const std::vector<std::uint32_t>& moving = wish.moving.vertices;
  const auto place_of = [&](std::uint32_t v) {
    const auto found = std::lower_bound(moving.begin(), moving.end(), v);
    return found != moving.end() && *found == v ? static_cast<std::size_t>(found - moving.begin()) : moving.size();
  };
  const auto factor_of = [&](std::uint32_t v) {
    return mesh_.frozen(v) ? 0 : held_index_[v] == kNone ? 1 : held[held_index_[v]].factor;
  };
  std::vector<std::size_t> twins;  // The places in `moving` of those of one cycle that move, alike ones together.
  const auto order = [&](std::size_t one, std::size_t other) {
    const auto key = [&](std::size_t i) {
      const glm::dvec3 &from = wish.before[i], &to = wish.after[i];
      return std::tuple(from.x, from.y, from.z, to.x, to.y, to.z);
    };
    return key(one) < key(other);
  };
  ++twin_turn_;
  for (const std::uint32_t v : vertices) {
    poll();
    if (next_twin_[v] == v || twin_seen_[v] == twin_turn_) continue;
    twins.clear();
    std::uint32_t twin = v;
    do {
      twin_seen_[twin] = twin_turn_;
      if (const std::size_t place = place_of(twin); place < moving.size()) twins.push_back(place);
      twin = next_twin_[twin];
    } while (twin != v);
    std::ranges::sort(twins, order);
    for (auto first = twins.begin(); first != twins.end();) {
      const auto end = std::upper_bound(first, twins.end(), *first, order);
      double least = 1;
      for (auto i = first; i != end; ++i) least = std::min(least, factor_of(moving[*i]));
      for (; first != end; ++first) {
        const std::uint32_t vertex = moving[*first];
        if (!(factor_of(vertex) > least)) continue;
        Held& h = held_index_[vertex] == kNone ? hold(vertex, wish, held) : held[held_index_[vertex]];
        h.factor = least;
        least > 0 ? place(h, {least, {}}) : mesh_.take_back(vertex);
        if (crossings_) crossings_->try_at(vertex, stored_at(h, least));
        changed.push_back(vertex);
      }
    }
  }
}

void PullBack::start_crossings(const std::vector<Held>& held, const Wish& wish) {
  const std::vector<std::uint32_t>& vertices = wish.moving.vertices;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const std::uint32_t v = vertices[i], h = held_index_[v];
    if (mesh_.frozen(v)) continue;
    crossings_->try_at(v, h == kNone ? wish.after[i] : stored_at(held[h], held[h].factor));
  }
}

/// Whether the vertex is elsewhere on trial than in the state.
bool PullBack::is_away(std::uint32_t vertex) const {
  return mesh_.step(vertex) != 0 || (crossings_ && crossings_->moves(vertex));
}

/// Adds the vertices in so many rings around these that are away from the state.
void PullBack::widen(std::vector<std::uint32_t>& vertices, std::size_t rings) {
  for (std::size_t before = 0; rings > 0 && vertices.size() > before; --rings) {
    before = vertices.size();
    const std::vector<std::uint32_t> faces = mesh_.faces_around(vertices);
    vertices.clear();
    for (const std::uint32_t f : faces) {
      for (const std::uint32_t v : mesh_.corners_of(f)) {
        if (is_away(v)) vertices.push_back(v);
      }
    }
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  }
}

/// Sends a vertex back by the next share of its way, or all the way where less than `least` would be left.
void PullBack::retreat(Held& held, Mode mode, double least) {
  if (held.retreat == 0) held.factor_before = held.factor;
  if (mode == Mode::reset) {
    held.factor = 0;
  } else if (held.retreat < kShrink) {
    held.retreat = held.retreat == 0 ? kRetreat : 2 * held.retreat;
    held.factor = held.factor_before * (1 - held.retreat);
  } else {
    held.factor *= kShrink;
  }
  if (held.factor < least) held.factor = 0;
  held.factor > 0 ? place(held, {held.factor, {}}) : mesh_.take_back(held.vertex);
  if (crossings_) crossings_->try_at(held.vertex, stored_at(held, held.factor));
}

}  // namespace tolvol
