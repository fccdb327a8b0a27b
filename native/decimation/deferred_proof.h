// SPDX-License-Identifier: GPL-3.0-or-later
/// Collapses on trust: the collapses of a region are carried out first, and the bounds are proved once for the faces
/// that they lead to, instead of for every mesh on the way. Where no proof is found the region is put back as it was.
///
/// While the tolerance is wide for the faces of the mesh, hardly any collapse would be refused, and most of the work
/// would be to prove each.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "decimation/bounded_mesh.h"
#include "decimation/certified_bounds.h"
#include "decimation/change.h"
#include "decimation/edge_collapse.h"
#include "decimation/quadric.h"
#include "decimation/surroundings.h"

namespace tolvol {

class DeferredProof {
 public:
  /// Remembers a region as it is: its vertices, and the faces that have one of them. `places`: per face of the mesh,
  /// for its place among them; one array for all regions. `crossings` is null where crossings are allowed. Keeps
  /// references to all of it, and to the mesh's bounds, which are certified.
  DeferredProof(EdgeCollapse& collapse, BoundedMesh& mesh, NewCrossings* crossings,
                std::span<const std::uint32_t> vertices, std::span<const std::uint32_t> faces,
                std::vector<std::uint32_t>& places);

  /// Whether the proofs of the region can be put off: not if it has boundary edges with bounds of their own.
  bool possible() const;
  /// Notes a collapse of the region that is about to be carried out.
  void note(const Change& change);
  /// Whether the region, as it is now, keeps the bounds and makes no new crossing with the faces around it; if so,
  /// further changes start from it. `around`, which is null where crossings are allowed, takes the faces as they are
  /// now. It takes about 0.1 us for each face, and for each piece of the reference there; and 3 us for each changed
  /// face where crossings are not allowed.
  bool holds(Surroundings* around);
  /// Puts the region back as it was, if holds() has returned false or was not asked.
  void take_back();

 private:
  std::uint32_t successor(std::uint32_t place) const;
  bool faces_hold();
  bool is_uncrossed(Surroundings& around) const;
  bool pieces_hold();

  EdgeCollapse& collapse_;
  BoundedMesh& mesh_;
  CertifiedBounds& bounds_;
  NewCrossings* crossings_;  ///< Null where crossings are allowed.
  std::span<const std::uint32_t> vertices_, faces_;
  std::vector<std::uint32_t>& places_;
  const BoundedMesh::Saved saved_;
  const CertifiedBounds::Saved saved_bounds_;
  std::vector<Quadric> quadrics_;       ///< For each vertex of the region, its quadric before the collapses on trust.
  std::vector<std::uint32_t> origins_;  ///< For each face, the state of the input faces that it stands for.
  std::vector<std::uint8_t> changed_;   ///< For each face, whether it has changed.
  std::vector<std::uint32_t> successors_;  ///< For each face, the place of the face that took it over, or its own.
  std::vector<std::uint32_t> alive_;       ///< The places of the faces that are left.
  std::vector<std::uint32_t> rank_;        ///< For each place of a face that is left, where it stands among them.
};

}  // namespace tolvol
