// SPDX-License-Identifier: GPL-3.0-or-later
/// The promise that a moving mesh gets no new crossings: two faces may cross (topology/faces_cross.h) only where they
/// crossed at the start, and no face becomes degenerate that was not degenerate then.
///
/// Faces keep their numbers while they move, so that the pairs that cross are always among those of the start. A quad
/// is two triangles in either of its triangulations, and the promise holds in all of them: of the triangles of two
/// quads, no pair crosses anew. Those of one quad are not compared, because a concave one in a plane has a fold of its
/// own in one of its triangulations. Points and segments never cross.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "check/tolerance_check.h"
#include "motion/clearance.h"
#include "motion/moving_faces.h"
#include "topology/faces_cross.h"

namespace tolvol {

/// It holds the start, a state that has no new crossings, and beside it a trial, which equals the state at first.
/// Positions are as they are stored.
class MovingCrossings {
 public:
  /// Takes the stored positions as the start. `faces` has `corners` (1 to 4) indices for each face, as in Pieces; keeps
  /// a reference to them. About 0.2 us a face.
  MovingCrossings(std::span<const std::uint32_t> faces, int corners, std::span<const glm::dvec3> stored,
                  unsigned threads);

  /// From now on looks only at faces that have come so far that they could cross others, for those who move all
  /// vertices by little again and again. Costs 1.5 us a face once, and as much for faces that have come so far. `mesh`
  /// has the same faces, which must be triangles; keeps a reference to it.
  void skip_short_ways(MovingMesh& mesh);

  void try_at(std::uint32_t vertex, const glm::dvec3& stored) { trial_[vertex] = stored; }
  /// Whether the vertex is elsewhere on trial than in the state.
  bool moves(std::uint32_t vertex) const { return trial_[vertex] != state_[vertex]; }

  /// Returns faces of new crossings and new degenerate faces on trial, ascending; none if there are none. All of
  /// `faces` that are such are returned. Where very many meet one face, not all others that it crosses are, so that
  /// what was returned has to be asked about again. Every face must be asked about after the last change to a corner.
  /// Throws Cancelled; take_back() has to follow then. About 1 us a face that moves, for a quad 5 us.
  std::vector<std::uint32_t> failing(std::span<const std::uint32_t> faces, Progress* progress);
  /// Looks at these faces, whose corners are others now, in the state, which is on trial: which of them cross another
  /// one or are degenerate, whatever was at the start?
  std::vector<std::uint32_t> crossing_replaced(std::span<const std::uint32_t> faces);
  /// Fits the boxes of these faces to the corners that they have now.
  void fit(std::span<const std::uint32_t> faces);
  /// Makes the state the start.
  void restart() { start_ = state_; }
  /// Makes the trial of these vertices the state, for which failing() found no face last.
  void accept(std::span<const std::uint32_t> vertices);
  /// Makes the state the trial of these vertices. `faces` are all faces around them. It never throws.
  void take_back(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces);
  /// Prepares the next trial, which equals the state. Throws Cancelled.
  void tidy();

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  using Positions = std::vector<glm::dvec3>;
  /// The triangles of a face that are looked at.
  std::span<const PieceTriangle> shapes(std::uint32_t face) const;
  Corners corners(const Positions& positions, std::uint32_t face, const PieceTriangle& shape) const;
  /// A box around a vertex on trial, as MovingFaces asks for it.
  auto on_trial() const {
    return [this](std::uint32_t vertex) { return Box{trial_[vertex], trial_[vertex]}; };
  }
  template <class Visit>
  void for_each_near(std::uint32_t face, Visit&& visit) const;
  bool is_due(std::uint32_t face) const;
  bool degenerates(std::uint32_t face) const;
  bool triangles_cross(std::uint32_t a, const PieceTriangle& shape_a, std::uint32_t b,
                       const PieceTriangle& shape_b) const;
  template <class Pair>
  bool any_pair(std::uint32_t a, std::uint32_t b, Pair&& pair) const;
  bool cross_anew(std::uint32_t a, std::uint32_t b) const;
  void test(std::uint32_t face, std::vector<glm::uvec2>& failed) const;
  void test_left_out(std::uint32_t face, std::vector<glm::uvec2>& failed) const;
  void build();

  std::size_t face_count() const { return faces_.size() / corners_; }
  std::span<const std::uint32_t> corners_of(std::uint32_t face) const {
    return faces_.subspan(std::size_t{face} * corners_, corners_);
  }

  std::span<const std::uint32_t> faces_;
  std::size_t corners_;
  unsigned threads_;
  Positions start_, state_, trial_;
  MovingFaces near_;                   // The faces as they are on trial, or wherever they have clearance.
  double extent_ = 0;                  // MovingFaces::extent() when it was built.
  std::size_t refitted_ = 0;           // The number of boxes that changed since extent() was looked at.
  std::vector<std::uint32_t> asked_;   // For each face: in which call failing() looked at it last.
  std::vector<std::uint32_t> failed_;  // For each face: in which call it failed last.
  // For each face: the one that it was found to cross anew last, or kNone. It is tried first when the face is asked
  // about again, because as a rule it has to go back several times.
  std::vector<std::uint32_t> met_;
  std::uint32_t now_ = 0;  // The number of these calls.
  std::optional<Clearance> clearance_;
  /// The faces that were looked at since tidy(): their boxes in the tree are those of the trial.
  std::vector<std::uint32_t> fitted_;
  std::vector<bool> is_fitted_;  // For each face.
};

}  // namespace tolvol
