// SPDX-License-Identifier: GPL-3.0-or-later
/// Keeps a moving mesh inside a tolerance volume, and its reference within the tolerance of it, and keeps its faces
/// from turning over and from crossing: vertices of faces that would leave the volume, turn too far away from it, leave
/// a part of the reference without a witness or cross another face anew are pulled back along their motion.
/// constrain(), Guard and smooth() share it. It keeps the state from one motion to the next.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "check/outside.h"
#include "motion/moving_mesh.h"

namespace tolvol {

class MovingCoverage;
class MovingCrossings;

class PullBack {
 public:
  enum class Mode {
    pull_back,  ///< Each vertex goes as far as the tolerance lets it: none can rise by 1/64 of its motion alone.
    settle,     ///< The same, except for the last 4 % of the tolerance, which take most of the time.
    halve,      ///< Factors are halved, in a tangle quartered, until the promises of move() hold: for repeated steps.
    reset,      ///< Vertices go all the way back or not at all, the one step back of [Botsch04, §5].
  };

  /// Whether faces may come to cross each other, or to be degenerate: see MovingCrossings.
  enum class Crossings { keep_out, allow };

  /// A set of vertices that move together, ascending, and the faces that touch one of them.
  struct Moving {
    std::vector<std::uint32_t> vertices, faces;
  };

  struct Result {
    std::vector<double> factors;         ///< For each moving vertex: the share of its motion, 0 to 1.
    std::vector<glm::dvec3> reached;     ///< For each moving vertex: the stored position there.
    std::size_t held_back = 0;           ///< The number of factors below 1.
    std::size_t kept_from_crossing = 0;  ///< The number of these vertices that went back so that no faces cross.
  };

  /// Has the parameters of MovingMesh.
  PullBack(const ToleranceVolume& volume, const StoredSpace& space, std::span<const std::uint32_t> faces, int corners,
           std::size_t vertex_count, unsigned threads);
  ~PullBack();
  PullBack(const PullBack&) = delete;
  PullBack& operator=(const PullBack&) = delete;

  struct StartOptions {
    Outside outside = Outside::error;
    bool two_sided = true;  ///< Keeps the backward direction, too: see MovingCoverage.
    Crossings crossings = Crossings::keep_out;
    double max_normal_angle = 90;  ///< In degrees; 180 keeps no angle. See MovingMesh::start().
    bool short_ways = false;       ///< Says that all vertices will move by little, again and again.
    /// Keeps vertices at one place together, and what holds T-junctions together (topology/t_junctions.h) where it is.
    bool together = true;
  };
  /// What the state is short of, and will be after any motion.
  struct Start {
    std::vector<std::uint32_t> outside;  ///< Faces that are not proved inside, ascending. Their vertices never move.
    FaceCount uncovered;  ///< Faces of the reference that are not covered. What is nearest to them never moves.
    /// Faces with no proof of the angle, ascending. They keep the least angle that is proved of them.
    std::vector<std::uint32_t> exceeding;
    std::vector<std::string> warnings;
  };
  /// Takes the stored positions as the state. Throws what MovingMesh::start() throws, FacesOutside as the options say,
  /// and InvalidInput for two_sided where the faces have fewer than 3 corners. About 1 us a vertex and, two-sided, 2 us
  /// a face of the reference; nothing for faces of the reference itself. Keeping crossings out costs 0.2 us a face, and
  /// keeping places and T-junctions together as much.
  Start start(std::span<const glm::dvec3> stored, const StartOptions& options, Progress* progress);
  bool frozen(std::uint32_t vertex) const { return mesh_.frozen(vertex); }
  std::optional<Normals> normals() const { return mesh_.normals(); }                  ///< See MovingMesh.
  bool may_be_unsure(std::uint32_t face) const { return mesh_.may_be_unsure(face); }  ///< See MovingMesh.

  /// Makes these faces, whose corners in the array of the constructor are others now, part of the state: a polygon is
  /// triangulated in another way. None of them may be outside, exceeding or without a sure normal since the start, and
  /// each repeats the same corners as before, if any. Returns those that are not inside, exceed their angle, cross
  /// others, would leave a part of the reference without a witness or are nearest to an uncovered one. If there are
  /// any, the array has to be as it was before, and restore_faces() has to follow. From then on faces may cross only if
  /// they cross now. Throws Cancelled; start() has to follow then.
  std::vector<std::uint32_t> replace_faces(std::span<const std::uint32_t> faces, Progress* progress);
  void restore_faces(std::span<const std::uint32_t> faces);

  Moving moving(std::vector<std::uint32_t> vertices);

  /// Moves each vertex from `before`, its stored position now, towards `after`, and makes where it ends the new state.
  /// All faces of the new state are inside, the reference is covered, no face exceeds its angle, and no faces cross
  /// that did not at the start; constrain.h says what else holds of the factors. Vertices that were at one place at the
  /// start and have the same `before` and `after` have the same factor. Throws InvalidInput, for a wish that is not
  /// finite, and Cancelled; both change nothing. A settled face costs about 10 ns, and a face near the tolerance about
  /// 1 us for each try. Keeping crossings out costs about 1 us a face.
  Result move(const Moving& moving, std::span<const glm::dvec3> before, std::span<const glm::dvec3> after, Mode mode,
              Progress* progress);

 private:
  /// A vertex that cannot simply have its wish.
  struct Held {
    std::uint32_t vertex;
    glm::dvec3 before, after;     ///< In stored coordinates.
    MovingMesh::PointBound wish;  ///< At `after`.
    double length;                ///< The length of the motion, in the frame.
    double factor = 0;
    /// About the factor at which the vertex itself leaves the volume, 1 only if it does not leave it. In Mode::settle,
    /// the factor that it is to reach.
    double largest_factor = 1;
    /// In Mode::pull_back and Mode::settle: the share of `factor_before` by which it went back for the reference or a
    /// crossing; kShrink if that was more, or after a tangle.
    double retreat = 0;
    double factor_before = 0;         ///< The factor before it did.
    bool kept_from_crossing = false;  ///< Whether it went back because of a crossing.
    MovingMesh::Blame blame{};
    std::uint32_t colour = 0;
  };

  /// A place on the way of a vertex.
  struct Along {
    double factor;
    MovingMesh::PointBound bound;
  };

  /// A motion as move() is asked for it.
  struct Wish {
    const Moving& moving;
    std::span<const glm::dvec3> before, after;
  };

  glm::dvec3 stored_at(const Held& held, double factor) const;
  void place(Held& held, const Along& along);
  Held& hold(std::uint32_t vertex, const Wish& wish, std::vector<Held>& held);
  Result finish(const Wish& wish, Mode mode, Progress* progress);
  std::vector<Held> hold(const Wish& wish, std::vector<std::uint32_t> failed, Progress* progress);
  Along along(const Held& held, double factor, std::uint32_t hint) const;
  Along leaving_point(const Held& held, double target, Along inner, Along outer) const;
  void release(Held& held, Mode mode);
  void pull(std::vector<Held>& held, Mode mode, Progress* progress);
  void let_go(std::vector<Held>& held, Mode mode, Progress* progress);
  std::uint32_t colour(std::vector<Held>& held) const;
  template <class Visit>
  void held_around(std::uint32_t vertex, Visit&& visit) const;
  double little(const Held& held) const;
  void raise(Held& held, Mode mode, bool search);
  bool attempt(Held& held, double factor);
  void back_off(std::vector<Held>& held, const Wish& wish, Mode mode, Progress* progress);
  void link_twins(std::span<const std::uint32_t> place);
  void hold_twins(const Wish& wish, std::span<const std::uint32_t> vertices, std::vector<Held>& held,
                  std::vector<std::uint32_t>& changed);
  void start_crossings(const std::vector<Held>& held, const Wish& wish);
  bool is_away(std::uint32_t vertex) const;
  void widen(std::vector<std::uint32_t>& vertices, std::size_t rings);
  void retreat(Held& held, Mode mode, double least, bool is_tangled);

  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  /// When step (3) of pull_back.cpp ends in Mode::pull_back, no factor alone can rise by this much.
  static constexpr double kRise = 1.0 / 64;
  /// A factor shrinks to this share in each round of step (2) in which a face of the vertex fails, and in step (4) as
  /// retreat() says.
  static constexpr double kShrink = 0.5;

  MovingMesh mesh_;
  std::unique_ptr<MovingCoverage> coverage_;    // Null if only the forward direction is kept.
  std::unique_ptr<MovingCrossings> crossings_;  // Null if faces may cross.
  std::vector<std::uint32_t> held_index_;       // For each vertex: its place among the held ones, or kNone.
  /// For each vertex: the next of the vertices that were at its place at the start. They form a ring; that of a vertex
  /// without twins is the vertex itself. Empty if no two vertices were at one place.
  std::vector<std::uint32_t> next_twin_;
  std::vector<std::uint64_t> twin_seen_;  // For each vertex: in which turn of hold_twins() it was looked at.
  std::uint64_t twin_turn_ = 0;           // The number of these turns.
};

}  // namespace tolvol
