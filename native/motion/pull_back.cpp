// SPDX-License-Identifier: GPL-3.0-or-later
// Three steps. (1) Where all have their wish, faces that fail send their vertices back to where they were, in rounds,
// until none fails: this is the paper's reset [Botsch04, §5], but with all vertices moving at once, as the faces of the
// result have to be inside in the state that results and not each for itself. (2) Those vertices start again from as
// far as they would be inside alone, and go back by shares in rounds while faces fail, at the worst to step (1). (3)
// One after the other, they go forward again as far as the faces around them let them; vertices that share no face are
// taken at the same time, a colour of them after the other, so that the result does not depend on threads.
//
// The fourth step keeps the backward direction, and faces from crossing: pull_back_retreat.cpp. Steps (2) and (3) are
// in pull_back_forward.cpp.
#include "motion/pull_back.h"

#include <algorithm>

#include "base/call.h"
#include "check/input_checks.h"
#include "geometry/triangle_mesh.h"
#include "geometry/weld.h"
#include "motion/moving_coverage.h"
#include "motion/moving_crossings.h"

namespace tolvol {

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
  Start result{std::move(start.outside), {}, mesh_.exceeding(), std::move(start.warnings)};
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

std::vector<std::uint32_t> PullBack::replace_faces(std::span<const std::uint32_t> faces, Progress* progress) {
  mesh_.make_rings();
  std::vector<std::uint32_t> refused = mesh_.uncertified(faces, progress);
  if (crossings_) {
    const std::vector<std::uint32_t> crossing = crossings_->crossing_replaced(faces);
    refused.insert(refused.end(), crossing.begin(), crossing.end());
    std::ranges::sort(refused);
    refused.erase(std::unique(refused.begin(), refused.end()), refused.end());
  }
  if (refused.empty() && coverage_) refused = coverage_->failing_replaced(faces);
  if (!refused.empty()) return refused;
  const Call::Within uninterrupted(nullptr);
  if (coverage_) coverage_->accept(faces);
  mesh_.accept({}, faces);
  if (crossings_) crossings_->restart();
  return {};
}

void PullBack::restore_faces(std::span<const std::uint32_t> faces) {
  mesh_.make_rings();
  if (crossings_) crossings_->fit(faces);
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
  try {
    mesh_.try_all(moving.vertices, before, after);
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
  const Call::Within uninterrupted(nullptr);
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

}  // namespace tolvol
