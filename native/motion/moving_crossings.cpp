// SPDX-License-Identifier: GPL-3.0-or-later
// Only pairs of which one face moves can begin to cross. Nearly all of these are told apart by a box.
#include "motion/moving_crossings.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/call.h"
#include "base/parallel.h"

namespace tolvol {
namespace {

/// The number of faces that a thread takes at a time, for work of about 1 us each.
constexpr std::size_t kFacesAtOnce = 64;
/// Once a face is known to cross another anew, it is compared with this many more whose boxes meet its own: where very
/// many faces meet, all of them have to go back anyway.
constexpr std::size_t kFurther = 64;
/// The trees of faces are built anew when their boxes have become more than this many times as large.
constexpr double kWorn = 2;

/// Whether it is `face` that looks at a pair of faces that were both asked about. Each face looks at about a half of
/// all others: if it were for the one with the lower number, one with a high number would come past very many in a
/// tangle before it met one that it looks at.
bool looks_at(std::uint32_t face, std::uint32_t other) {
  const bool is_for_lower = ((face + other) * 0x9E3779B1u) >> 31;
  return is_for_lower == (face < other);
}

}  // namespace

MovingCrossings::MovingCrossings(std::span<const std::uint32_t> faces, int corners, std::span<const glm::dvec3> stored,
                                 unsigned threads)
    : faces_(faces),
      corners_(static_cast<std::size_t>(corners)),
      threads_(threads),
      start_(stored.begin(), stored.end()),
      state_(start_),
      trial_(start_) {
  if (corners_ < 3) return;
  asked_.assign(face_count(), 0);
  failed_.assign(face_count(), 0);
  met_.assign(face_count(), kNone);
  is_fitted_.assign(face_count(), false);
  near_ = MovingFaces(faces_, corners_, stored.size());
  build();
}

void MovingCrossings::build() {
  Team team(thread_count(threads_));
  near_.build(on_trial(), team);
  extent_ = near_.extent();
  refitted_ = 0;
}

void MovingCrossings::skip_short_ways(MovingMesh& mesh) {
  clearance_.emplace(mesh, state_);
  extent_ = 0;
}

void MovingCrossings::tidy() {
  const bool worn = refitted_ > face_count() && near_.extent() > kWorn * extent_;
  if (refitted_ > face_count()) refitted_ = 0;
  if (worn) build();
  if (!clearance_) {
    for (const std::uint32_t f : fitted_) is_fitted_[f] = false;
    fitted_.clear();
    return;
  }
  if (worn) {
    is_fitted_.assign(face_count(), true);
    fitted_.resize(face_count());
    std::iota(fitted_.begin(), fitted_.end(), 0u);
  }
  const auto fit = [&](auto&& has_room) {
    std::erase_if(fitted_, [&](std::uint32_t f) {
      if (!has_room(f)) return false;
      near_.change(f, clearance_->in_room());
      is_fitted_[f] = false;
      return true;
    });
  };
  fit([&](std::uint32_t f) { return !is_due(f); });
  clearance_->renew(state_, near_);
  fit([&](std::uint32_t f) { return !clearance_->rests(f); });
  if (worn || extent_ == 0) extent_ = near_.extent();
}

std::span<const PieceTriangle> MovingCrossings::shapes(std::uint32_t face) const {
  const std::span<const PieceTriangle> all = triangles_of(static_cast<int>(corners_));
  if (corners_ == 3) return all;
  // A quad that repeats a corner is a triangle.
  const auto c = corners_of(face);
  const auto repeats = [&](const PieceTriangle& t) {
    return c[t[0]] == c[t[1]] || c[t[1]] == c[t[2]] || c[t[2]] == c[t[0]];
  };
  if (std::ranges::none_of(all, repeats)) return all;
  const auto whole = std::ranges::find_if_not(all, repeats);
  return all.subspan(whole == all.end() ? 0 : static_cast<std::size_t>(whole - all.begin()), 1);
}

Corners MovingCrossings::corners(const Positions& positions, std::uint32_t face, const PieceTriangle& shape) const {
  const auto c = corners_of(face);
  return {positions[c[shape[0]]], positions[c[shape[1]]], positions[c[shape[2]]]};
}

/// Calls visit(other) for all faces that the face may cross on trial, until it returns false.
template <class Visit>
void MovingCrossings::for_each_near(std::uint32_t face, Visit&& visit) const {
  if (corners_ == 3) {
    near_.for_each_near(face, corners(trial_, face, triangles_of(3).front()), on_trial(), visit);
  } else {
    near_.for_each_near(face, on_trial(), visit);
  }
}

/// Whether the face may cross others anew.
bool MovingCrossings::is_due(std::uint32_t face) const {
  return std::ranges::any_of(corners_of(face),
                             [&](std::uint32_t v) { return clearance_ ? !clearance_->has(v, trial_[v]) : moves(v); });
}

bool MovingCrossings::triangles_cross(std::uint32_t a, const PieceTriangle& shape_a, std::uint32_t b,
                                      const PieceTriangle& shape_b) const {
  const Corners one = corners(trial_, a, shape_a), other = corners(trial_, b, shape_b);
  return faces_cross(one, other);
}

/// Whether the face, or a triangle of it, becomes degenerate and was not so at the start.
bool MovingCrossings::degenerates(std::uint32_t face) const {
  return std::ranges::any_of(shapes(face), [&](const PieceTriangle& shape) {
    return is_degenerate(corners(trial_, face, shape)) && !is_degenerate(corners(start_, face, shape));
  });
}

/// Whether `pair` is true for a triangle of one face and a triangle of the other whose boxes meet on trial.
template <class Pair>
bool MovingCrossings::any_pair(std::uint32_t a, std::uint32_t b, Pair&& pair) const {
  if (corners_ == 3) {
    const PieceTriangle& whole = triangles_of(3).front();
    return pair(whole, whole);
  }
  const std::span<const PieceTriangle> of_a = shapes(a), of_b = shapes(b);
  return std::ranges::any_of(of_a, [&](const PieceTriangle& shape_a) {
    return std::ranges::any_of(of_b, [&](const PieceTriangle& shape_b) {
      return meet(box_of(corners(trial_, a, shape_a)), box_of(corners(trial_, b, shape_b))) && pair(shape_a, shape_b);
    });
  });
}

bool MovingCrossings::cross_anew(std::uint32_t a, std::uint32_t b) const {
  return any_pair(a, b, [&](const PieceTriangle& shape_a, const PieceTriangle& shape_b) {
    return triangles_cross(a, shape_a, b, shape_b) &&
           !faces_cross(corners(start_, a, shape_a), corners(start_, b, shape_b));
  });
}

void MovingCrossings::fit(std::span<const std::uint32_t> faces) {
  if (corners_ < 3) return;
  for (const std::uint32_t f : faces) near_.change(f, on_trial());
}

std::vector<std::uint32_t> MovingCrossings::crossing_replaced(std::span<const std::uint32_t> faces) {
  fit(faces);
  std::vector<std::uint32_t> result;
  for (const std::uint32_t face : faces) {
    poll();
    bool crosses = std::ranges::any_of(
        shapes(face), [&](const PieceTriangle& shape) { return is_degenerate(corners(trial_, face, shape)); });
    const auto visit = [&](std::uint32_t other) {
      crosses =
          other != face && any_pair(face, other, [&](const PieceTriangle& of_face, const PieceTriangle& of_other) {
            return triangles_cross(face, of_face, other, of_other);
          });
      return !crosses;
    };
    if (!crosses) for_each_near(face, visit);
    if (crosses) result.push_back(face);
  }
  return result;
}

/// Adds to `failed` pairs of the face and another that it crosses anew, or of itself twice where it becomes degenerate.
/// Of two faces that were both asked about, looks_at() tells which one looks at the pair. A face that is known to cross
/// another looks only for those that were not asked about.
void MovingCrossings::test(std::uint32_t face, std::vector<glm::uvec2>& failed) const {
  if (degenerates(face)) failed.emplace_back(face, face);
  bool crosses = met_[face] != kNone && cross_anew(face, met_[face]);
  if (crosses) failed.emplace_back(face, met_[face]);
  std::size_t looked_at = 0, further = 0;
  for_each_near(face, [&](std::uint32_t other) {
    if (++looked_at % 64 == 0) poll();
    further += crosses;
    const bool left_out = other == face || (asked_[other] == now_ && (crosses || !looks_at(face, other)));
    if (!left_out && cross_anew(face, other)) {
      crosses = true;
      failed.emplace_back(face, other);
    }
    return further < kFurther;
  });
}

/// Adds to `failed` the pairs of this face and others that test() left out although exactly one of the two fails: the
/// one that looks_at() names had failed already and did not look.
void MovingCrossings::test_left_out(std::uint32_t face, std::vector<glm::uvec2>& failed) const {
  const bool fails = failed_[face] == now_;
  std::size_t looked_at = 0;
  for_each_near(face, [&](std::uint32_t other) {
    if (++looked_at % 64 == 0) poll();
    if (asked_[other] != now_ || (failed_[other] == now_) == fails) return true;
    if (!(fails ? looks_at(face, other) : looks_at(other, face)) || !cross_anew(face, other)) return true;
    failed.emplace_back(face, other);
    return fails;
  });
}

std::vector<std::uint32_t> MovingCrossings::failing(std::span<const std::uint32_t> faces, Progress* progress) {
  if (corners_ < 3) return {};
  ++now_;
  std::vector<std::uint32_t> asked;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    poll_at(i);
    const std::uint32_t f = faces[i];
    // A face that is back where it was may meet one that is not asked about, which went on meanwhile.
    if (!is_fitted_[f]) {
      if (!is_due(f)) continue;
      fitted_.push_back(f), is_fitted_[f] = true;
    }
    asked_[f] = now_;
    asked.push_back(f);
  }
  near_.change(asked, on_trial());
  refitted_ += asked.size();
  std::vector<std::vector<glm::uvec2>> found((asked.size() + kFacesAtOnce - 1) / kFacesAtOnce);
  std::vector<std::uint32_t> result;
  const auto look = [&](auto&& of_face) {
    parallel_for(asked.size(), kFacesAtOnce, threads_, [&](std::size_t begin, std::size_t end) {
      if (progress) progress->poll();
      for (std::size_t i = begin; i < end; ++i) of_face(asked[i], found[begin / kFacesAtOnce]);
    });
    for (std::vector<glm::uvec2>& pairs : found) {
      for (const glm::uvec2& pair : pairs) {
        for (int k = 0; k < 2; ++k) {
          if (std::exchange(failed_[pair[k]], now_) == now_) continue;
          result.push_back(pair[k]);
          if (pair.x != pair.y) met_[pair[k]] = pair[1 - k];
        }
      }
      pairs.clear();
    }
  };
  look([&](std::uint32_t face, std::vector<glm::uvec2>& pairs) { test(face, pairs); });
  if (result.empty()) return result;
  // The smaller group looks: the faces that fail, or those that do not.
  const bool failing_look = result.size() < asked.size() / 2;
  look([&](std::uint32_t face, std::vector<glm::uvec2>& pairs) {
    if ((failed_[face] == now_) == failing_look) test_left_out(face, pairs);
  });
  std::sort(result.begin(), result.end());
  return result;
}

void MovingCrossings::accept(std::span<const std::uint32_t> vertices) {
  for (const std::uint32_t v : vertices) state_[v] = trial_[v];
}

void MovingCrossings::take_back(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces) {
  for (const std::uint32_t v : vertices) trial_[v] = state_[v];
  if (corners_ < 3) return;
  for (const std::uint32_t f : faces) {
    if (is_fitted_[f]) near_.change(f, on_trial());
  }
}

}  // namespace tolvol
