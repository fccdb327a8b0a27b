// SPDX-License-Identifier: GPL-3.0-or-later
/// A mesh inside a tolerance volume whose vertices are tried at other places. It tells which faces would be inside
/// there.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "check/certificate.h"
#include "check/tolerance_check.h"
#include "check/tolerance_volume.h"
#include "geometry/frame.h"
#include "motion/moving_facing.h"

namespace tolvol {

/// Throws InvalidInput for the first face, of so many corners, with an index that is not below `vertex_count`.
void require_vertices(std::span<const std::uint32_t> faces, std::size_t corners, std::size_t vertex_count);

/// It holds a state, all of which is inside, and beside it a trial, which equals the state at first. Positions are in
/// the frame.
class MovingMesh {
 public:
  static constexpr double kUnknown = std::numeric_limits<double>::infinity();

  /// What is known of the distance from a place to the reference: it is kUnknown until it is asked for. Far beyond the
  /// tolerance it is huge, and there is no triangle.
  using PointBound = TriangleCertificate::PointBound;

  struct Start {
    std::vector<std::uint32_t> outside;  ///< Faces that are not proved inside, ascending. Their vertices never move.
    std::vector<std::string> warnings;   ///< By storage_warning() and facing_rule().
  };

  /// `faces` has `corners` (1 to 4) indices for each face, as in Pieces. Keeps references to `volume` and `faces`.
  /// Throws InvalidInput for an index that is not below `vertex_count`. O(n + m).
  MovingMesh(const ToleranceVolume& volume, const StoredSpace& space, std::span<const std::uint32_t> faces, int corners,
             std::size_t vertex_count, unsigned threads);

  /// Takes the stored positions as state and trial. `max_normal_angle`, in degrees, is kept from then on (see
  /// MovingFacing); 180 keeps no angle. A face that exceeds it keeps the least angle that can be proved of it, to
  /// within a degree. If more of a connected part of the mesh keeps the angle by its other side, the part is compared
  /// by that side.
  /// `place` has the first vertex at the place of each, or is empty if vertices at one place are not connected. Throws
  /// InvalidInput for a position that is not finite, and where the stored type cannot hold the tolerance. About 1 us a
  /// vertex; for faces of the reference itself 0.5 us a face, and nothing where no angle is kept.
  Start start(std::span<const glm::dvec3> stored, double max_normal_angle, std::span<const std::uint32_t> place,
              Progress* progress);

  /// Whether a triangle of the face had no sure normal at the start, so that it may be without one.
  bool may_be_unsure(std::uint32_t face) const;
  /// Maps each vertex to its faces. start() does this; it has to be done again when faces have other corners.
  void make_rings();
  /// Certifies these faces on trial by a search alone, whatever is known of them. Returns those for which there is no
  /// proof.
  std::vector<std::uint32_t> uncertified(std::span<const std::uint32_t> faces, Progress* progress);
  /// Tries all these vertices at stored positions; those that may not move stay. Throws InvalidInput, changing nothing,
  /// for the first position that is not finite in the world or in the frame.
  void try_all(std::span<const std::uint32_t> vertices, std::span<const glm::dvec3> before,
               std::span<const glm::dvec3> after);
  /// Tries a vertex at a position. `bound` is what is known of that place.
  void try_at(std::uint32_t vertex, const glm::dvec3& at, const PointBound& bound);
  void take_back(std::uint32_t vertex) { trial_[vertex] = state_[vertex], step_[vertex] = 0; }
  /// Which of these faces are not inside on trial. Every face must be asked about after the last change to a corner.
  /// A settled face costs about 10 ns, a face near the tolerance 0.1 us or much more.
  std::vector<std::uint32_t> failing(std::span<const std::uint32_t> faces, Progress* progress);
  /// The face that refused a vertex last, and where. It is asked first when the vertex is tried again, because most
  /// often it refuses there, too: then one point of one face was looked at.
  struct Blame {
    std::uint32_t place = 0;     ///< The face is at this place of the vertex's ring.
    std::uint32_t triangle = 0;  ///< The number of the triangle in the face.
    /// A point of the triangle around which no witness was found, by the weights of the corners; NaN if none is known.
    glm::dvec3 weights{std::numeric_limits<double>::quiet_NaN()};
  };
  /// Tries the vertex there if all faces around it are inside then; returns whether. Different threads may ask for
  /// vertices that share no face. The distances of all corners must be known: measure(). If a face refuses, `blame`
  /// names it.
  bool try_alone(std::uint32_t vertex, const glm::dvec3& at, Blame& blame);
  void measure(std::span<const std::uint32_t> faces, Progress* progress);
  /// Which of these faces, all of which are inside on trial, exceed their angle there.
  std::vector<std::uint32_t> turned(std::span<const std::uint32_t> faces, Progress* progress);
  /// Makes the trial of these vertices the state. `faces` are all faces around them.
  void accept(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces);
  /// The same where a longer search than that of failing() has proved that no face is outside and none is turned().
  void accept_proved(std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces, Progress* progress);

  const glm::dvec3& state(std::uint32_t vertex) const { return state_[vertex].at; }
  const glm::dvec3& trial(std::uint32_t vertex) const { return trial_[vertex].at; }
  /// From now on, keeps in mind where vertices were refused: 64 bytes a vertex, for those who push the same ones
  /// against the limit again and again. It saves searches and changes no answer.
  void remember_refusals() { refusals_.resize(state_.size()); }
  /// Finds the distance itself where the grid's guess leaves little room.
  PointBound bound_at(const glm::dvec3& at) const;
  /// Does so for a place where a vertex is tried, on its wish or a little ahead of where it is.
  enum class Aim { wish, ahead };
  PointBound bound_at(std::uint32_t vertex, const glm::dvec3& at, Aim aim);
  /// Whether the bound is the distance itself, and neither a guess nor unknown.
  bool is_exact(const PointBound& bound) const {
    return bound.distance != kUnknown && !certificates_.front().leaves_room(bound.distance);
  }
  const PointBound& bound_of_state(std::uint32_t vertex) const { return state_[vertex].bound; }
  const PointBound& bound_of_trial(std::uint32_t vertex) const { return trial_[vertex].bound; }
  double step(std::uint32_t vertex) const { return step_[vertex]; }  ///< The length from state to trial.
  bool frozen(std::uint32_t vertex) const { return frozen_[vertex]; }
  bool any_frozen() const { return any_frozen_; }
  /// The vertex never moves from now on.
  void freeze(std::uint32_t vertex) { frozen_[vertex] = any_frozen_ = true; }
  /// How the faces of the state face the reference; none where no angle is kept. About 50 ns a face.
  std::optional<Normals> normals() const;
  /// The faces that exceeded the angle at the start, ascending.
  const std::vector<std::uint32_t>& exceeding() const { return exceeding_; }
  /// Freezes what holds T-junctions together in these stored positions (topology/t_junctions.h), because faces that
  /// meet there share no vertex by which they could be kept together while they move. `place` is as for start(), and
  /// not empty. Returns a warning if that holds any vertex that could move. About 0.3 us a face.
  std::optional<std::string> hold_t_junctions(std::span<const glm::dvec3> stored, std::span<const std::uint32_t> place);
  double provable() const { return provable_; }
  double limit() const { return limit_; }  ///< The provable distance less a headroom.
  const ToleranceVolume& volume() const { return *volume_; }
  const StoredSpace& space() const { return space_; }
  unsigned threads() const { return threads_; }

  std::span<const std::uint32_t> faces() const { return faces_; }
  std::size_t vertex_count() const { return state_.size(); }
  std::size_t face_count() const { return faces_.size() / corners_; }
  int corners() const { return static_cast<int>(corners_); }
  /// Whether the face equals the reference's face of this number in the state.
  bool is_own(std::uint32_t face) const;
  std::span<const std::uint32_t> corners_of(std::uint32_t face) const {
    return faces_.subspan(std::size_t{face} * corners_, corners_);
  }
  std::span<const std::uint32_t> ring(std::uint32_t vertex) const {
    return std::span(ring_).subspan(ring_start_[vertex], ring_start_[vertex + 1] - ring_start_[vertex]);
  }
  /// Returns each face around these vertices once.
  std::vector<std::uint32_t> faces_around(std::span<const std::uint32_t> vertices);

 private:
  struct VertexState {
    glm::dvec3 at;
    PointBound bound;  ///< The distance is kFar if the vertex is far beyond the tolerance.
  };

  /// No point of the reference is within the tolerance of any place nearer to `at` than `margin`.
  struct Refusal {
    glm::dvec3 at{0};
    double margin = 0;
  };

  // Neither kFar nor kUnknown proves anything when it is taken for an upper bound.
  static constexpr double kFar = std::numeric_limits<double>::max();
  static constexpr double kUnproved = TriangleCertificate::kUnproved;

  void set_trial(std::uint32_t vertex, const VertexState& state);
  /// What is known of all points of a face.
  struct FaceBound {
    double distance = kUnproved;
    MovingFacing::Known facing;
  };
  using TriangleCorners = glm::dvec3[3];
  bool is_too_long(std::uint32_t face) const;
  FaceBound bound_by_motion(std::uint32_t face) const;
  FaceBound bound_by_certificate(std::uint32_t face, Blame* blame = nullptr) const;
  double distance_by(const TriangleCertificate& certificate, std::uint32_t face, MovingFacing::Known& facing,
                     Blame* blame) const;
  bool refuses_again(std::uint32_t face, const Blame& blame) const;
  bool is_inside(std::uint32_t face) const;
  void set_trial_bound(std::uint32_t face, const FaceBound& bound);
  void accept(std::uint32_t face);
  bool is_plainly_oriented(std::span<const std::uint32_t> place) const;
  void start_facing(FacingRule rule, std::span<const std::uint32_t> place, Team& team);
  std::vector<double> balance(std::span<const std::uint32_t> failing) const;
  std::vector<std::uint32_t> compare_sides(std::vector<std::uint32_t> failing, Progress* progress);
  std::vector<std::uint32_t> take_uncertified(std::span<const std::uint32_t> faces, Progress* progress);
  bool limit_angle(std::uint32_t face);
  template <class Visit>
  void for_triangles(std::uint32_t face, Visit&& visit) const;

  const ToleranceVolume* volume_;
  StoredSpace space_;
  std::span<const std::uint32_t> faces_;
  std::size_t corners_;
  unsigned threads_;                              ///< The number of threads to use, never 0.
  std::vector<std::uint32_t> ring_start_, ring_;  // They map each vertex to its faces.
  std::vector<bool> frozen_;
  bool any_frozen_ = false;
  double provable_ = 0, limit_ = 0;  // The distance that the certificate decides by, and the part that is used.
  std::vector<TriangleCertificate> certificates_;  // One for each of these two; none before start().
  std::vector<VertexState> state_, trial_;
  std::vector<double> step_;
  // For each vertex the last refusal of each Aim; empty unless refusals are remembered.
  std::vector<std::array<Refusal, 2>> refusals_;
  std::vector<double> distance_, trial_distance_;  // For each face: no point of it is farther from the reference.
  std::optional<MovingFacing> facing_;             // None if no angle is kept.
  double max_normal_angle_ = 180;                  // In degrees.
  std::vector<std::uint32_t> part_;  // For each face: its connected part; empty if no part can need its other side.
  std::vector<std::uint32_t> exceeding_;
  std::vector<std::uint64_t> seen_;  // For each face: in which call faces_around() met it last.
  std::uint64_t now_ = 0;            // The number of these calls.
};

/// Calls visit(triangle's number in the face, its corners on trial, what is known of them) until it returns false.
template <class Visit>
void MovingMesh::for_triangles(std::uint32_t face, Visit&& visit) const {
  const auto corner = corners_of(face);
  std::size_t triangle = 0;
  for (const auto& [a, b, c] : triangles_of(static_cast<int>(corners_))) {
    const VertexState &p = trial_[corner[a]], &q = trial_[corner[b]], &r = trial_[corner[c]];
    const glm::dvec3 corners[3] = {p.at, q.at, r.at};
    const PointBound* const bounds[3] = {&p.bound, &q.bound, &r.bound};
    if (!visit(triangle++, corners, bounds)) return;
  }
}

}  // namespace tolvol
