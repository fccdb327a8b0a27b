// SPDX-License-Identifier: GPL-3.0-or-later
// Three steps. (1) Where all have their wish, faces that fail send their vertices back to where they were, in rounds,
// until none fails: this is the paper's reset [Botsch04, §5], but with all vertices moving at once, as the faces of the
// result have to be inside in the state that results and not each for itself. (2) Those vertices start again from as
// far as they would be inside alone, and go back by shares in rounds while faces fail, at the worst to step (1). (3)
// One after the other, they go forward again as far as the faces around them let them; vertices that share no face are
// taken at the same time, a colour of them after the other, so that the result does not depend on threads.
#include "operation/pull_back.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "reference/parallel.h"

namespace tolvol {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

constexpr double kRise = 1.0 / 64;  // what no factor can rise by in the end
constexpr double kShrink = 0.5;     // of a factor, in each round in which a face of the vertex fails
/// Of the provable distance: where vertices are put first, as pieces of a quarter of the tolerance prove a face there.
constexpr double kComfort = 0.97;
constexpr int kCrossings = 8;       // tries to find where a vertex leaves the volume; a plane takes one
constexpr double kClose = 0.002;    // of the provable distance: near enough to that place
constexpr std::size_t kBlock = 32;  // vertices, for work of some us each

}  // namespace

PullBack::PullBack(const ToleranceVolume& volume, const Placement& placement, std::span<const std::uint32_t> faces,
                   int corners, std::size_t vertex_count, unsigned threads)
    : mesh_(volume, placement, faces, corners, vertex_count, threads), held_index_(vertex_count, kNone) {}

MovingMesh::Start PullBack::start(std::span<const glm::dvec3> stored, Progress* progress) {
  held_index_.assign(stored.size(), kNone);
  return mesh_.start(stored, progress);
}

PullBack::Moving PullBack::moving(std::vector<std::uint32_t> vertices) {
  Moving result{std::move(vertices), {}};
  result.faces = mesh_.faces_around(result.vertices);
  return result;
}

PullBack::Result PullBack::move(const Moving& moving, std::span<const glm::dvec3> before,
                                std::span<const glm::dvec3> after, Mode mode, Progress* progress) {
  const std::vector<std::uint32_t>& vertices = moving.vertices;
  mesh_.try_all(vertices, before, after);
  Result result{std::vector<double>(vertices.size(), 1), {after.begin(), after.end()}, 0};
  std::vector<std::uint32_t> failed = mesh_.failing(moving.faces, progress);
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
  for (std::size_t i = 0; mesh_.any_frozen() && i < vertices.size(); ++i) {
    if (!mesh_.frozen(vertices[i])) continue;
    result.factors[i] = 0, result.reached[i] = before[i];
    ++result.held_back;
  }
  mesh_.accept(vertices, moving.faces);
  return result;
}

/// Step (1). Ends, because a face that fails has a corner away from the state, in which it did not fail.
std::vector<PullBack::Held> PullBack::hold(const Moving& moving, std::span<const glm::dvec3> before,
                                           std::span<const glm::dvec3> after, std::vector<std::uint32_t> failed,
                                           Progress* progress) {
  std::vector<Held> held;
  std::vector<std::uint32_t> back;
  for (; !failed.empty(); failed = mesh_.failing(mesh_.faces_around(back), progress)) {
    back.clear();
    for (const std::uint32_t f : failed) {
      for (const std::uint32_t v : mesh_.corners_of(f)) {
        if (mesh_.step(v) == 0) continue;
        const auto place =
            std::lower_bound(moving.vertices.begin(), moving.vertices.end(), v) - moving.vertices.begin();
        held.push_back({v, before[place], after[place], mesh_.step(v)});
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
  return mesh_.placement().storage() == Storage::float32 ? rounded_to_float32(p) : p;
}

void PullBack::place(const Held& held, double factor) {
  mesh_.try_at(held.vertex, mesh_.placement().frame(stored_at(held, factor)));
}

/// A factor at which the vertex itself is about `target` from the reference, at the most, between one where it is
/// nearer and one where it is farther: false position, in which an end that stays twice counts half (Illinois).
double PullBack::crossing(const Held& held, double target, Along near, Along far) const {
  double near_excess = near.distance - target, far_excess = far.distance - target;
  for (int i = 0; i < kCrossings && near_excess < -kClose * mesh_.within(); ++i) {
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
  const glm::dvec3 at = mesh_.placement().frame(stored_at(held, factor));
  const std::uint32_t guess = mesh_.volume().grid().triangle_near(at);
  const Hierarchy::Nearest nearest = mesh_.volume().hierarchy().nearest(at, std::numeric_limits<double>::infinity(),
                                                                        guess == DistanceGrid::kNone ? hint : guess);
  return {factor, nearest.distance, nearest.triangle};
}

/// Finds where the vertex leaves the volume if nothing else held it, and puts it a little before that.
void PullBack::release(Held& held) {
  // A wish at the end of the world tells nothing: all of the volume is in this box.
  const double box = 1 + 2 * mesh_.volume().frame_tolerance();
  const glm::dvec3 from = mesh_.state(held.vertex), way = mesh_.placement().frame(held.after) - from;
  double exit = 1;
  for (int k = 0; k < 3; ++k) {
    if (way[k] != 0) exit = std::min(exit, std::max(0.0, (std::copysign(box, way[k]) - from[k]) / way[k]));
  }
  const Along far = along(held, exit, kNone), near = along(held, 0, far.triangle);
  held.factor = held.limit = 1;
  if (far.distance > mesh_.within()) {
    held.limit = near.distance < mesh_.within() ? crossing(held, mesh_.within(), near, far) : 0;
    held.factor = near.distance < kComfort * mesh_.within() ? crossing(held, kComfort * mesh_.within(), near, far) : 0;
  }
  place(held, held.factor);
}

/// Step (2).
void PullBack::pull(std::vector<Held>& held, Progress* progress) {
  parallel_for(held.size(), kBlock, mesh_.threads(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) release(held[i]);
  });
  std::vector<std::uint32_t> changed;
  changed.reserve(held.size());
  for (const Held& h : held) changed.push_back(h.vertex);
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
      if (h.factor * h.length < (1 - kComfort) * mesh_.within()) h.factor = 0;
      place(h, h.factor);
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
          if (is_due[other] || held[other].factor >= 1) return;
          is_due[other] = true;
          due[held[other].colour].push_back(other);
        });
      }
    }
  }
}

bool PullBack::attempt(Held& held, double factor) {
  if (!mesh_.try_alone(held.vertex, mesh_.placement().frame(stored_at(held, factor)), held.blame)) return false;
  held.factor = factor;
  return true;
}

void PullBack::raise(Held& held, Mode mode, bool search) {
  const double little = (1 - kComfort) * mesh_.within() / held.length;
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

}  // namespace tolvol
