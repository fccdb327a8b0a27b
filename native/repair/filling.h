// SPDX-License-Identifier: GPL-3.0-or-later
/// Fills one hole with triangles between its corners.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include "repair/earlier_fillings.h"
#include "repair/filling_rules.h"
#include "repair/loop_outcome.h"
#include "topology/faces_cross.h"

namespace tolvol {

/// Searches for the triangles of one hole, and counts what refused others.
class Filling {
 public:
  /// Keeps references to all. The hole has been measured, and has its most_steps. If `earlier` is given, the hole has
  /// to keep apart from the fillings of lower holes.
  Filling(const FillingRules& rules, Hole& hole, const EarlierFillings* earlier = nullptr)
      : rules_(rules), hole_(hole), earlier_(earlier) {}

  /// Fills the hole, or leaves it without faces, and returns its outcome.
  LoopOutcome run();

 private:
  struct Obstacle {
    Corners corners;
    Box box;
  };

  using Answers = std::unordered_map<std::uint64_t, std::optional<LoopOutcome>>;  ///< by number()

  std::uint64_t number(std::uint64_t i, std::uint64_t j) const { return i * hole_.at.size() + j; }
  std::uint64_t number(const glm::uvec3& face) const { return number(number(face.x, face.y), face.z); }
  /// Whether the hole has one triangulation only.
  bool is_triangle() const { return hole_.at.size() == 3; }
  bool is_long() const;
  bool has_ears();
  LoopOutcome reason() const;
  LoopOutcome give_up();
  bool refuse(LoopOutcome reason);
  bool gives_up() const;
  bool admits_edge(std::uint32_t i, std::uint32_t j);
  bool admits(const glm::uvec3& face);
  std::optional<LoopOutcome> refusal_of(const glm::uvec3& face);
  std::optional<LoopOutcome> refusal_by_rules(const glm::uvec3& face);
  template <class Ask>
  std::optional<LoopOutcome> answer(Answers& answers, std::uint64_t number, bool keep, Ask&& ask);
  bool prove_guess();
  template <class Visit>
  void for_each_near(const Corners& stored, Visit&& visit) const;
  bool goes_around(const Corners& stored) const;
  bool is_clear();
  bool is_sound();

  const FillingRules& rules_;
  Hole& hole_;
  const EarlierFillings* earlier_;
  std::size_t refused_triangles_ = 0, steps_ = 0;  ///< in all searches
  std::vector<Obstacle> obstacles_;                ///< faces that an earlier try crossed
  bool is_guessing_ = true;      ///< whether the present search leaves the rules of triangles for later
  Answers of_faces_, of_edges_;  ///< what refuses the triangles and edges that the rules were asked about
  std::set<std::array<std::uint32_t, 3>> left_out_;
  std::set<std::array<std::uint32_t, 2>> left_out_edges_;
  std::array<std::size_t, kLoopOutcomeNames.size()> refused_{};  ///< for each outcome, in the present search
};

}  // namespace tolvol
