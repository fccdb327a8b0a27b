// SPDX-License-Identifier: GPL-3.0-or-later
/// This is the default check, the witness certificate.
///
/// Let T be one reference triangle and let each corner p_i of a piece have a witness q_i in T with |p_i - q_i| <=
/// epsilon. Then every convex combination of the corners is within epsilon of the same combination of the witnesses,
/// which is in T: the whole piece is inside. This needs a guess for T, which the grid's closest-triangle ids give, but
/// no interpolation, and it holds at any precision. Pieces that no single triangle covers are split.
///
/// If a piece is proved to be inside, so is each of its parts when it is checked alone: a corner, an edge, the triangle
/// in any order of its corners, or a quad (a, b, c, a). There are two reasons. The search for a proof orders the
/// corners by position, so that its result does not depend on their order in the piece. A segment or point that this
/// search leaves unproved is decided along its line (segment_cover.h), where the search is exhaustive: the witnesses of
/// a larger piece cover the segment, and the search finds witnesses wherever some cover it. The reason that is tried
/// first, short edges between near corners, holds for every part if it holds for the piece.
#pragma once

#include <optional>

#include "check/tolerance_check.h"
#include "check/witness.h"

namespace tolvol {

class Facing;

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

/// The certificate for the inner loop of an operation. It checks one triangle at a time, with fixed thresholds.
class TriangleCertificate {
 public:
  /// `limit` is the provable distance (ToleranceVolume::provable()) and `beyond` the refutable one, in the frame. Keeps
  /// references to the mesh of `reference`, to the grid and to the hierarchy. With a grid without nodes the hierarchy
  /// finds all triangles.
  TriangleCertificate(const Witnesses& reference, const DistanceGrid& grid, const Hierarchy& hierarchy, double limit,
                      double beyond);

  static constexpr double kUnproved = std::numeric_limits<double>::infinity();

  /// Returns an upper bound, at most limit(), on the distance of any point of the triangle from the reference, or
  /// kUnproved if no proof was found. `bounds` are upper bounds on the distances of the corners, by witnesses and never
  /// by field values, or infinity if none is known. `hints` are triangles of the reference that are tried first. If
  /// `facing` is not null, it admits and notes every witness, and names the triangles of `bounds`.
  double bound(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds,
               const glm::uvec3& hints = glm::uvec3(Hierarchy::kNone), Facing* facing = nullptr) const;

  /// The same, but prefers a bound that leaves some of limit(), because the triangles that later take the place of this
  /// one may use what it leaves. If there is no such bound the cost is up to twice that of bound().
  double bound_with_room(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds, Facing* facing = nullptr) const;

  /// The same by a longer search, whose result does not depend on the order of the corners. A triangle that has a bound
  /// here has the verdict inside. If there is no bound and `open` is not null, it is set to a point of the triangle
  /// around which the search found no witness: most often it is farther than limit() from all that `facing` admits. If
  /// `steps` is not null, the steps of the search are added to it, each about 0.07 us: two for a part of the triangle,
  /// one for a node of the hierarchy that is visited, and one for four triangles of a list (check/near_triangles.h).
  double bound_in_any_order(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds,
                            const glm::uvec3& hints = glm::uvec3(Hierarchy::kNone), Facing* facing = nullptr,
                            glm::dvec3* open = nullptr, std::size_t* steps = nullptr) const;

  /// Tells whether there is a proof in any order of the corners, and if not, whether a point outside proves that there
  /// is none. The reference must be as large as in a frame, see witness_error(). `facing` is as for bound(): a point is
  /// then outside, too, if no triangle near it is admitted.
  Verdict verdict(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds,
                  const glm::uvec3& hints = glm::uvec3(Hierarchy::kNone), Facing* facing = nullptr) const;

  struct PointBound {
    double distance = kUnproved;                ///< is an upper bound on the distance to the triangle
    std::uint32_t triangle = Hierarchy::kNone;  ///< is a triangle of the reference
  };
  /// Returns the grid's guess if it is well below limit(), or else the nearest triangle within the radius, if there is
  /// one. A proof of faces around p needs no more, and the result depends on the position of p alone.
  PointBound nearest(const glm::dvec3& p, double radius) const;
  /// Tells whether nearest() takes a guess of this distance.
  bool leaves_room(double distance) const;

  /// Returns an upper bound on the distance of p from the reference: by the grid's guess or, if that is beyond limit(),
  /// by a search. It is infinite if p is beyond the grid, or if there is neither a guess nor a triangle within limit().
  PointBound point_bound(const glm::dvec3& p) const;
  double distance_bound(const glm::dvec3& p) const { return point_bound(p).distance; }

  /// Returns one of at most 42 points of the triangle, none of them a corner, that is_open(), so that the triangle has
  /// no bound; or none if no point is. This takes a hundredth of the time of a proof for a large triangle, and finds
  /// most triangles that have no proof. `hints` are triangles of the reference that are tried before the hierarchy is
  /// searched.
  std::optional<glm::dvec3> point_outside(const glm::dvec3 (&corners)[3], const Facing* facing = nullptr,
                                          const glm::uvec3& hints = glm::uvec3(Hierarchy::kNone)) const;

  /// The point of the reference that is nearest to p among the triangles that the grid's nodes around p name. Where the
  /// reference is far from p, it may have a nearer point; that is rare. Where the nodes are several tolerances apart,
  /// it is the nearest point of all.
  std::optional<glm::dvec3> nearby_point(const glm::dvec3& p) const;
  /// The point of the reference that is nearest to p, at most `radius` away, among the triangles that `facing` admits,
  /// or among all if it is null.
  std::optional<glm::dvec3> nearest_point(const glm::dvec3& p, double radius, const Facing* facing) const;

  /// Tells whether p is farther than limit() from all triangles that `facing` admits, or from all if it is null, by
  /// more than rounding. No triangle that contains p has a bound with such a `facing`. About 1 us, and 0.1 us near the
  /// triangle of the grid's nearest node or one of the `hints`, triangles that are tried before the hierarchy is
  /// searched.
  bool is_open(const glm::dvec3& p, const Facing* facing, const glm::uvec3& hints = glm::uvec3(Hierarchy::kNone)) const;

  double limit() const { return limit_; }
  /// Returns a certificate with `share`, 0 to 1, of the provable distance.
  TriangleCertificate narrowed(double share) const {
    return {reference_, *grid_, *hierarchy_, share * limit_, beyond_};
  }

 private:
  /// Says how long a search goes on. A quick search is one of many tries. A fine search finds nearly all proofs that a
  /// verdict finds. A verdict searches as long as there is any hope, or until it finds a point outside.
  enum class Search { quick, fine, verdict };

  double bound_by_corners(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds) const;
  template <Search kSearch>
  double bound_by(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds, const glm::uvec3& hints, Facing* facing,
                  glm::dvec3* open = nullptr, std::size_t* steps = nullptr) const;
  template <Search kSearch>
  Verdict search(const glm::dvec3 (&corners)[3], const glm::uvec3& hints, Facing* facing, double& farthest,
                 glm::dvec3* open = nullptr, std::size_t* steps = nullptr) const;

  Witnesses reference_;
  const DistanceGrid* grid_;
  const Hierarchy* hierarchy_;
  double limit_, limit2_, beyond_;
};

}  // namespace tolvol
