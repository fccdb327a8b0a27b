// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/filling.h"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "base/call.h"
#include "repair/least_triangulation.h"

namespace tolvol {
namespace {

/// A loop is searched for a filling at most so many times, a long one less often, and a guess that is refused does not
/// count. After each search but the last, faces that are in the way are gone around, and one of two triangles that
/// cross, or that lie on one edge, is left out.
constexpr int kMostTries = 32, kMostTriesOfLong = 8;
/// A loop with more corners than this is long.
constexpr std::size_t kLong = 200;
/// So many triangulations of a loop may be refused as guesses. A guess is found before its triangles are proved. Where
/// it keeps the rules, which is usual, its n - 2 triangles are all that need a proof; a search that asks the rules as
/// it goes proves n / 2 times as many. A long loop is often the border of an open surface, most of whose triangles are
/// refused: to find a guess takes longer there than to ask. Therefore it has one guess, and none if fewer than two ears
/// keep the rules.
constexpr int kMostGuesses = 8, kMostGuessesOfLong = 1;
/// A loop is given up after so many of its triangles were refused, in all searches together.
constexpr std::size_t kMostRefused = 50'000;
/// Where the triangles of a loop cross more faces than so many, each further triangle is compared with all faces near
/// it instead of with these.
constexpr std::size_t kMostObstacles = 64;

}  // namespace

LoopOutcome Filling::run() {
  TriangulationRules rules{[this](std::uint32_t i, std::uint32_t j) { return admits_edge(i, j); },
                           [this](const glm::uvec3& face) { return admits(face); }};
  const int most_tries = is_long() ? kMostTriesOfLong : kMostTries;
  int guesses_left = is_long() ? (has_ears() ? kMostGuessesOfLong : 0) : kMostGuesses;
  for (int tries = 0;;) {
    is_guessing_ = guesses_left > 0;
    refused_.fill(0);
    hole_.faces = least_triangulation(hole_.at, rules);
    if (gives_up()) return give_up();
    if (hole_.faces.empty()) {
      if (!is_guessing_ || tries > 0) break;
      // No triangulation keeps the rules. A search that asks them as it goes tells which of them refuses most.
      guesses_left = 0;
      continue;
    }
    std::sort(hole_.faces.begin(), hole_.faces.end(), [](const glm::uvec3& a, const glm::uvec3& b) {
      return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z};
    });
    if (is_guessing_ && !prove_guess()) {
      --guesses_left;
      continue;
    }
    if (is_clear() && is_sound()) return LoopOutcome::closed;
    if (is_triangle()) break;
    if (++tries == most_tries) return give_up();
  }
  hole_.faces.clear();
  return reason();
}

/// Whether at least two triangles that have two sides at the rim keep the rules. Each triangulation has at least two of
/// them.
bool Filling::has_ears() {
  const auto n = static_cast<std::uint32_t>(hole_.at.size());
  int ears = 0;
  for (std::uint32_t tip = 0; tip < n && ears < 2; ++tip) {
    poll();
    std::array<std::uint32_t, 3> corners{(tip + n - 1) % n, tip, (tip + 1) % n};
    std::ranges::sort(corners);
    ears += !refusal_by_rules({corners[0], corners[1], corners[2]});
  }
  return ears == 2;
}

LoopOutcome Filling::give_up() {
  hole_.faces.clear();
  return LoopOutcome::given_up;
}

bool Filling::is_long() const { return hole_.at.size() > kLong; }

LoopOutcome Filling::reason() const {
  // Across a corner of one triangle there is an edge already, and a rim that has points on a straight line makes
  // triangles without an area, whatever else there is.
  const auto first = refused_.begin(), others = first + static_cast<int>(LoopOutcome::non_manifold);
  const auto most = std::max_element(first, others);
  return static_cast<LoopOutcome>((*most > 0 ? most : std::max_element(others, refused_.end())) - first);
}

bool Filling::refuse(LoopOutcome reason) {
  ++refused_[static_cast<std::size_t>(reason)];
  return false;
}

bool Filling::gives_up() const { return refused_triangles_ >= kMostRefused || steps_ >= hole_.most_steps; }

bool Filling::admits_edge(std::uint32_t i, std::uint32_t j) {
  if (gives_up()) return false;
  if (left_out_edges_.contains({i, j}) || (earlier_ && earlier_->has_edge(rules_.edge_of(hole_, i, j)))) {
    return refuse(LoopOutcome::non_manifold);
  }
  const std::optional<LoopOutcome> refusal =
      answer(of_edges_, number(i, j), !is_long(), [&] { return rules_.refusal_of_edge(hole_, i, j); });
  return !refusal || refuse(*refusal);
}

bool Filling::admits(const glm::uvec3& face) {
  if (gives_up()) return false;
  const std::optional<LoopOutcome> refusal = refusal_of(face);
  refused_triangles_ += refusal.has_value();
  return !refusal || refuse(*refusal);
}

std::optional<LoopOutcome> Filling::refusal_of(const glm::uvec3& face) {
  if (left_out_.contains({face.x, face.y, face.z})) return LoopOutcome::crossing;
  if (is_guessing_) {
    const auto known = of_faces_.find(number(face));
    if (known != of_faces_.end() && known->second) return known->second;
  } else if (const std::optional<LoopOutcome> refusal = refusal_by_rules(face)) {
    return refusal;
  }
  if (!goes_around(rules_.corners_of(hole_, face))) return LoopOutcome::crossing;
  return std::nullopt;
}

std::optional<LoopOutcome> Filling::refusal_by_rules(const glm::uvec3& face) {
  return answer(of_faces_, number(face), !is_long() || is_guessing_,
                [&] { return rules_.refusal_of_face(hole_, face, steps_); });
}

/// Returns ask(), or what it has returned before for this number, if it may be kept. All answers of a long loop would
/// take too much memory; those about its guesses are few.
template <class Ask>
std::optional<LoopOutcome> Filling::answer(Answers& answers, std::uint64_t number, bool keep, Ask&& ask) {
  const auto known = answers.find(number);
  if (known != answers.end()) return known->second;
  return keep ? answers.emplace(number, ask()).first->second : ask();
}

/// Whether all triangles of a guess keep the rules. Searches refuse those that do not from now on.
bool Filling::prove_guess() {
  bool keeps = true;
  for (const glm::uvec3& face : hole_.faces) {
    poll();
    keeps = !refusal_by_rules(face) && keeps;
  }
  return keeps;
}

/// Calls visit(corners) for all faces of the input, and of the fillings that the hole has to keep apart from, that a
/// triangle crosses, and for some others whose boxes meet its box. A visit that returns false is the last one.
template <class Visit>
void Filling::for_each_near(const Corners& stored, Visit&& visit) const {
  bool more = true;
  rules_.for_each_near(stored, [&](const Corners& other) { return more = visit(other); });
  if (earlier_ && more) earlier_->for_each_near(hole_, box_of(stored), visit);
}

/// Whether a triangle crosses nothing that an earlier try crossed.
bool Filling::goes_around(const Corners& stored) const {
  if (obstacles_.size() <= kMostObstacles) {
    const Box box = box_of(stored);
    return std::ranges::none_of(obstacles_, [&](const Obstacle& obstacle) {
      return meet(box, obstacle.box) && faces_cross(stored, obstacle.corners);
    });
  }
  bool clear = true;
  for_each_near(stored, [&](const Corners& other) { return clear = !faces_cross(stored, other); });
  return clear;
}

/// Whether the triangles cross no face of the input, and none of the fillings that the hole has to keep apart from.
/// All triangles of the next try go around what they cross. Hardly a hole has anything in it, so that it would take
/// most of the time to ask about all triangles whether they cross any face.
bool Filling::is_clear() {
  bool clear = true;
  for (const glm::uvec3& face : hole_.faces) {
    poll();
    const Corners stored = rules_.corners_of(hole_, face);
    for_each_near(stored, [&](const Corners& other) {
      if (!faces_cross(stored, other)) return true;
      clear = refuse(LoopOutcome::crossing);
      obstacles_.push_back({other, box_of(other)});
      return obstacles_.size() <= kMostObstacles && !is_triangle();
    });
  }
  return clear;
}

/// Whether the triangles fit together. If not, one of those that do not is left out of the next try.
bool Filling::is_sound() {
  bool sound = true;
  std::unordered_set<std::uint64_t> edges;
  hole_.for_each_inner_edge([&](std::uint32_t i, std::uint32_t j) {
    if (!sound || edges.insert(rules_.edge_of(hole_, i, j)).second) return;
    sound = false;
    left_out_edges_.insert({i, j});
  });
  std::vector<Corners> corners;
  std::vector<Box> boxes;
  for (const glm::uvec3& face : hole_.faces) {
    corners.push_back(rules_.corners_of(hole_, face));
    boxes.push_back(box_of(corners.back()));
  }
  for (std::size_t a = 0; a < corners.size() && sound; ++a) {
    poll();
    for (std::size_t b = 0; b < a && sound; ++b) {
      if (!meet(boxes[a], boxes[b]) || !faces_cross(corners[a], corners[b])) continue;
      sound = false;
      left_out_.insert({hole_.faces[a].x, hole_.faces[a].y, hole_.faces[a].z});
    }
  }
  if (!sound) refuse(left_out_.empty() ? LoopOutcome::non_manifold : LoopOutcome::crossing);
  return sound;
}

}  // namespace tolvol
