// SPDX-License-Identifier: GPL-3.0-or-later
// Step (4) of pull_back.cpp: while the reference would lose faces as witnesses, or faces would cross that did not at
// the start, the vertices of these faces go back, by a small share of the way first (by half of it in Mode::halve), and
// by a large one in a tangle. What goes back may uncover a part of the reference that it covered, leave the volume as
// its neighbours go on, or meet another face, so that all is asked again until all of it holds. In the state itself all
// of it does, so that this comes to an end.
#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "base/call.h"
#include "motion/moving_coverage.h"
#include "motion/moving_crossings.h"
#include "motion/pull_back.h"

namespace tolvol {
namespace {

/// Where the reference would lose a witness or faces would cross, a factor shrinks by this share first, then by twice
/// the share each time, and after half of it by kShrink. In Mode::halve it shrinks to the share kShrink each time, but
/// for a tangle.
constexpr double kRetreat = 1.0 / 16;
/// Where at least this many faces cross others, and they are more than half of those that move, the wish is a tangle.
/// Each factor shrinks to the share kUntangle then: small steps would leave nearly all of them crossing, and every step
/// looks at all of them.
constexpr std::size_t kTangle = 4096;
constexpr double kUntangle = 0.25;
/// Where vertices went back for crossings this many times and faces still cross, they go all the way back, together
/// with more and more rings of vertices around them: far from where they were, faces that stay in the way of others
/// meet them one after the other.
constexpr std::size_t kPatience = 64;

}  // namespace

/// Does step (4). It ends: a face that fails has a corner away from the state, or crosses a face that has one, because
/// nothing fails in the state. All of these corners go back, and a vertex is back in the state after some rounds in
/// which a face of it fails. A vertex that no step before has held goes back from its wish.
void PullBack::back_off(std::vector<Held>& held, const Wish& wish, Mode mode, Progress* progress) {
  if (crossings_) start_crossings(held, wish);
  // Crossings are looked for among the faces whose corners have moved since they were last.
  std::vector<std::uint32_t> changed, lost, untested = wish.moving.faces, since, again;
  // Witnesses are sought for all faces at first and at last, and for those around what went back in between.
  std::vector<std::uint32_t> went_back;
  bool has_asked_all = false, is_renewed = false;
  std::size_t rounds = 0;
  if (!next_twin_.empty()) hold_twins(wish, wish.moving.vertices, held, changed);
  for (;;) {
    // A face may fail because some of its corners went back and others did not.
    std::vector<std::uint32_t> failed = mesh_.failing(mesh_.faces_around(changed), progress);
    if (failed.empty() && coverage_) {
      if (!lost.empty()) lost = coverage_->still_failing(lost);
      if (lost.empty() && has_asked_all) {
        lost = coverage_->failing_around(went_back);
        went_back.clear();
      }
      if (lost.empty()) lost = coverage_->failing(wish.moving.faces), has_asked_all = true;
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
    const bool is_tangled = cross && failed.size() >= kTangle && 2 * failed.size() > wish.moving.faces.size();
    if (is_hasty) widen(changed, std::size_t{1} << std::min<std::size_t>(rounds - kPatience, 30));
    std::sort(changed.begin(), changed.end());
    changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
    for (const std::uint32_t v : changed) {
      if (held_index_[v] == kNone) hold(v, wish, held).factor = 1;
      Held& h = held[held_index_[v]];
      h.kept_from_crossing = h.kept_from_crossing || cross;
      double least = cross ? kRise : little(h);
      // A repeated step does not have to use up the last of the tolerance.
      if (mode == Mode::halve) least = std::max(least, little(h));
      retreat(h, is_hasty ? Mode::reset : mode, least, is_tangled);
    }
    if (!next_twin_.empty()) hold_twins(wish, std::vector(changed), held, changed);
    if (coverage_) went_back.insert(went_back.end(), changed.begin(), changed.end());
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

/// Sends a vertex back by the next share of its way, a large one in a tangle, or all the way where less than `least`
/// would be left.
void PullBack::retreat(Held& held, Mode mode, double least, bool is_tangled) {
  if (mode == Mode::reset) {
    held.factor = 0;
  } else if (is_tangled) {
    held.retreat = kShrink;
    held.factor *= kUntangle;
  } else if (mode != Mode::halve && held.retreat < kShrink) {
    if (held.retreat == 0) held.factor_before = held.factor;
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
