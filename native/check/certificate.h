// SPDX-License-Identifier: GPL-3.0-or-later
/// The witness certificate, the default check.
///
/// Let T be one reference triangle and let each corner p_i of a piece have a witness q_i in T with |p_i - q_i| <= epsilon. Then
/// every convex combination of the corners is within epsilon of the same combination of the witnesses, which is in T: the
/// whole piece is inside. This needs a guess for T (the grid's closest-triangle ids), no interpolation, and holds at any
/// precision. Pieces that no single triangle covers are split.
#pragma once

#include "check/tolerance_check.h"
#include "check/witness.h"

namespace tolvol {

class Certificate final : public ToleranceCheck {
 public:
  /// Keeps a reference to `volume`, which must outlive this.
  explicit Certificate(const ToleranceVolume& volume) : volume_(&volume) {}

  /// O(pieces) for small pieces: about 50 ns each near the reference; a large piece costs its area over the tolerance squared.
  std::vector<Verdict> check(const Pieces& pieces, const Options& options) const override;
  std::string method() const override { return "certificate"; }
  std::string renderer() const override { return "CPU"; }

 private:
  const ToleranceVolume* volume_;
};

/// The certificate for the inner loop of an operation: one triangle at a time, all thresholds fixed.
class TriangleCertificate {
 public:
  /// `within`: the provable distance, see ToleranceVolume::provable(); `beyond`: the refutable one. In the frame.
  TriangleCertificate(const TriangleMesh& reference, const DistanceGrid& grid, const Hierarchy& hierarchy, double within,
                      double beyond);

  /// `bounds`: upper bounds on the corners' distances to the reference (from witnesses, never field values); infinity where
  /// none is known.
  bool inside(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds) const;

  /// As inside(), and says whether a failure is proved.
  Verdict verdict(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds) const;

  /// An upper bound on the distance of p to the reference, from the grid's guess; infinity where there is none.
  double distance_bound(const glm::dvec3& p) const;

  double within() const { return within_; }

 private:
  struct Piece;
  template <bool kProve>
  Verdict decide(const glm::dvec3 (&corners)[3], const glm::dvec3& bounds) const;
  WitnessTriangle witness(std::uint32_t triangle) const;

  const TriangleMesh* reference_;
  const DistanceGrid* grid_;
  const Hierarchy* hierarchy_;
  double within_, within2_, beyond_;
};

}  // namespace tolvol
