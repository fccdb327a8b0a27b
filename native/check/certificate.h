// SPDX-License-Identifier: GPL-3.0-or-later
/// The witness certificate, the default check.
///
/// Let T be one reference triangle and let each corner p_i of a piece have a witness q_i in T with |p_i - q_i| <=
/// epsilon. Then every convex combination of the corners is within epsilon of the same combination of the witnesses,
/// which is in T: the whole piece is inside. This needs a guess for T (the grid's closest-triangle ids), no
/// interpolation, and holds at any precision. Pieces that no single triangle covers are split.
///
/// What is proved of a piece is proved of its parts, whatever they are asked as: corners, edges, a triangle in any
/// order of its corners, a quad (a, b, c, a). Two things make this so. The search for a proof takes the corners in an
/// order of its own, by position, so that it does not depend on the order in which they come. And a segment or point
/// that the search leaves unproved is decided along its line (segment_cover.h), where the search is exhaustive:
/// whatever proof there is of a larger piece, its witnesses cover the segment, and witnesses that cover a segment are
/// found. Short edges between near corners, the reason that is tried first, hold for every part as they hold for the
/// piece.
#pragma once

#include <optional>

#include "check/tolerance_check.h"
#include "check/witness.h"

namespace tolvol {

class Certificate final : public ToleranceCheck {
 public:
  /// Keeps a reference to `volume`, which must outlive this. A check costs O(pieces) for small pieces: about 50 ns each
  /// near the reference. The cost of a large piece is proportional to its area over the tolerance squared.
  explicit Certificate(const ToleranceVolume& volume) : ToleranceCheck(volume) {}

  std::string method() const override { return "certificate"; }
  std::string renderer() const override { return "CPU"; }

 private:
  std::vector<Verdict> verdicts(const PlacedPieces& pieces, const Options& options) const override;
};

/// The certificate for the inner loop of an operation: one triangle at a time, all thresholds fixed.
class TriangleCertificate {
 public:
  /// `limit`: the provable distance, see ToleranceVolume::provable(); `beyond`: the refutable one. In the frame.
  /// Keeps references to the rest. A grid without nodes leaves everything to the hierarchy.
  TriangleCertificate(const std::vector<WitnessTriangle>& reference, const DistanceGrid& grid,
                      const Hierarchy& hierarchy, double limit, double beyond);

  static constexpr double kUnproved = std::numeric_limits<double>::infinity();

  /// An upper bound, at most limit(), on the distance of any point of the triangle to the reference; kUnproved where
  /// no proof was found. `bounds`: upper bounds on the corners' distances (from witnesses, never field values);
  /// infinity where none is known. `hints`: triangles of the reference that may be near all of it, tried first.
  double bound(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds,
               const glm::uvec3& hints = glm::uvec3(Hierarchy::kNone)) const;

  /// The same, but one that leaves some of limit() where there is such a one: what a triangle has left, those that
  /// take its place may use. Up to twice the cost where there is none.
  double bound_with_room(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds) const;

  /// The same where the order of the corners makes no difference, by a longer search. What has a bound here has the
  /// verdict inside.
  double bound_in_any_order(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds,
                            const glm::uvec3& hints = glm::uvec3(Hierarchy::kNone)) const;

  /// Whether there is a proof, in any order of the corners, and if not, whether a point outside proves that there is
  /// none. The reference has the size of a frame, see witness_error().
  Verdict verdict(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds,
                  const glm::uvec3& hints = glm::uvec3(Hierarchy::kNone)) const;

  struct PointBound {
    double distance = kUnproved;                ///< upper bound
    std::uint32_t triangle = Hierarchy::kNone;  ///< of the reference, that it is to
  };
  /// The grid's guess where it is well below limit(), or else the nearest triangle within the radius, if any. A
  /// proof of faces around p needs no more, and what starts from this does not depend on how p came to be there.
  PointBound nearest(const glm::dvec3& p, double radius) const;
  /// Whether nearest() takes a guess of this distance.
  bool leaves_room(double distance) const;

  /// An upper bound on the distance of p to the reference, from the grid's guess, or from a search where the grid has
  /// none; infinity when that exceeds limit().
  double distance_bound(const glm::dvec3& p) const;

  /// Whether one of at most 42 points of the triangle is farther than limit(): a hundredth of what a proof for a large
  /// triangle takes, and finds most of those that have none.
  bool shows_outside(const glm::dvec3 (&corners)[3]) const;

  /// The point of the reference that is nearest to p among the triangles that the grid's nodes around p name. Where the
  /// reference is far from p, it may have a nearer point; that is rare.
  std::optional<glm::dvec3> nearby_point(const glm::dvec3& p) const;

  double limit() const { return limit_; }
  /// The same with `share`, 0 to 1, of the provable distance.
  TriangleCertificate narrowed(double share) const {
    return {*reference_, *grid_, *hierarchy_, share * limit_, beyond_};
  }

 private:
  /// How far a search goes. quick: for one of many tries. fine: as far as a verdict in nearly all cases, so that hardly
  /// anything is refused that has the verdict inside. verdict: as far as there is any sense in, or to a point outside.
  enum class Search { quick, fine, verdict };

  double bound_by_corners(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds) const;
  template <Search kSearch>
  double bound_by(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds, const glm::uvec3& hints) const;
  template <Search kSearch>
  Verdict search(const glm::dvec3 (&corners)[3], const glm::uvec3& hints, double& farthest) const;

  const std::vector<WitnessTriangle>* reference_;
  const DistanceGrid* grid_;
  const Hierarchy* hierarchy_;
  double limit_, limit2_, beyond_;
};

}  // namespace tolvol
