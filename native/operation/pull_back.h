// SPDX-License-Identifier: GPL-3.0-or-later
/// Keeps a moving mesh inside a tolerance volume: vertices of faces that would leave it are pulled back along their
/// motion. What constrain(), Guard and smooth() share; it holds the state from one motion to the next.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "check/certificate.h"
#include "check/tolerance_volume.h"
#include "reference/frame.h"
#include "reference/progress.h"

namespace tolvol {

class PullBack {
 public:
  enum class Mode {
    pull_back,  ///< as far as the tolerance lets each vertex go: none can rise by 1/64 of its motion alone
    settle,     ///< the same but for the last 3 % of the tolerance, which take most of the time
    halve,      ///< factors are halved until all faces are inside: quick, for steps that are repeated
    reset,      ///< all the way back or not at all, the one step back of [Botsch04, §5]
  };

  struct Start {
    std::vector<std::uint32_t> outside;  ///< faces that are not proved inside, ascending: their vertices never move
    std::optional<std::string> warning;  ///< of storage_warning()
  };

  /// A set of vertices that move together, ascending, and the faces that touch one of them.
  struct Moving {
    std::vector<std::uint32_t> vertices, faces;
  };

  struct Result {
    std::vector<double> factors;      ///< for each moving vertex: the share of its motion, 0 to 1
    std::vector<glm::dvec3> reached;  ///< for each moving vertex: the stored position there
    std::size_t held_back = 0;        ///< factors below 1
  };

  /// `faces`: `corners` (1 to 4) indices a face, as in Pieces. Keeps references to `volume` and `faces`. Throws
  /// InvalidInput for an index that is not below `vertex_count`. O(n + m).
  PullBack(const ToleranceVolume& volume, const Placement& placement, std::span<const std::uint32_t> faces, int corners,
           std::size_t vertex_count, unsigned threads);

  /// Takes the stored positions as the state to start from and to come back to. Throws InvalidInput for a position that
  /// is not finite, and where the stored type cannot hold the tolerance. About 1 us a vertex.
  Start start(std::span<const glm::dvec3> stored, Progress* progress);

  Moving moving(std::vector<std::uint32_t> vertices);

  /// Moves each vertex from `before`, its stored position now, towards `after`, and makes where it ends the new state.
  /// All faces of the new state are inside; see constrain.h for what else holds of the factors. Throws InvalidInput,
  /// changing nothing, for a wish that is not finite. After Cancelled only start() may be called. Settled faces cost
  /// about 10 ns each, those near the tolerance about 1 us a try.
  Result move(const Moving& moving, std::span<const glm::dvec3> before, std::span<const glm::dvec3> after, Mode mode,
              Progress* progress);

 private:
  /// A vertex in the frame; `distance` to the reference: kFar beyond the tolerance, kUnknown until asked for.
  struct Spot {
    glm::dvec3 at;
    double distance;
  };
  /// A vertex that cannot simply have its wish.
  struct Held {
    std::uint32_t vertex;
    glm::dvec3 before, after;  ///< stored
    double length;             ///< of the motion, in the frame
    double factor = 0;
    double limit = 1;         ///< about where the vertex itself leaves the volume; 1 only if it does not
    std::uint32_t blame = 0;  ///< place in the vertex's ring of the face that refused last
    std::uint32_t colour = 0;
  };

  /// A place on the way of a vertex, and the distance there.
  struct Along {
    double factor, distance;
    std::uint32_t triangle;  ///< the nearest
  };

  // Both prove nothing when they are taken for upper bounds.
  static constexpr double kUnknown = std::numeric_limits<double>::infinity();
  static constexpr double kFar = std::numeric_limits<double>::max();
  static constexpr double kUnproved = TriangleCertificate::kUnproved;

  std::span<const std::uint32_t> corners_of(std::uint32_t face) const {
    return faces_.subspan(std::size_t{face} * corners_, corners_);
  }
  std::span<const std::uint32_t> ring(std::uint32_t vertex) const {
    return std::span(ring_).subspan(ring_start_[vertex], ring_start_[vertex + 1] - ring_start_[vertex]);
  }
  void make_rings(std::size_t vertex_count);
  bool is_own(std::uint32_t face) const;
  double distance_of(const glm::dvec3& at) const;
  double reach_by_motion(std::uint32_t face) const;
  template <class Bound>
  double over_triangulations(std::uint32_t face, Bound&& bound) const;
  double reach_by_certificate(std::uint32_t face) const;
  void measure(std::span<const std::uint32_t> faces, Progress* progress);
  std::vector<std::uint32_t> failing(std::span<const std::uint32_t> faces, Progress* progress);
  std::vector<std::uint32_t> faces_around(std::span<const std::uint32_t> vertices);

  glm::dvec3 stored_at(const Held& held, double factor) const;
  void place(const Held& held, double factor);
  std::vector<Held> hold(const Moving& moving, std::span<const glm::dvec3> before, std::span<const glm::dvec3> after,
                         std::vector<std::uint32_t> failed, Progress* progress);
  Along along(const Held& held, double factor, std::uint32_t hint) const;
  double crossing(const Held& held, double target, Along near, Along far) const;
  void release(Held& held);
  void pull(std::vector<Held>& held, Progress* progress);
  void let_go(std::vector<Held>& held, Mode mode, Progress* progress);
  std::uint32_t colour(std::vector<Held>& held) const;
  template <class Visit>
  void held_around(std::uint32_t vertex, Visit&& visit) const;
  void raise(Held& held, Mode mode, bool search);
  bool attempt(Held& held, double factor);

  const ToleranceVolume* volume_;
  Placement placement_;
  std::span<const std::uint32_t> faces_;
  std::size_t corners_;
  unsigned threads_;
  std::vector<std::uint32_t> ring_start_, ring_;  // vertex -> its faces
  std::vector<bool> frozen_;
  bool any_frozen_ = false;
  double provable_ = 0, within_ = 0;               // what the certificate decides by, and what of it is used
  std::vector<TriangleCertificate> certificates_;  // for the two; none before start()
  std::vector<Spot> state_, trial_;
  std::vector<double> step_;                 // per vertex: from state_ to trial_
  std::vector<double> reach_, trial_reach_;  // per face: no point of it is farther from the reference
  std::vector<std::uint64_t> seen_;          // per face: when faces_around() last met it,
  std::uint64_t now_ = 0;                    // ... in calls
  std::vector<std::uint32_t> held_index_;    // per vertex: its place among the held ones, kNone
};

}  // namespace tolvol
