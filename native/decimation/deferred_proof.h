// SPDX-License-Identifier: GPL-3.0-or-later
/// Collapses on trust: those of a region are carried out first, and the bounds are proved for what they lead to, once
/// instead of for every mesh on the way. Where no proof is found the region is put back as it was.
///
/// While the tolerance is wide for the faces that there are, hardly any collapse would be refused, and proving each is
/// most of the work.
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

namespace tolvol {

class DeferredProof {
 public:
  /// Remembers a region as it is: its vertices, and the faces that have one of them. `places`: per face of the mesh,
  /// for its place among them; one array for all regions. Keeps references to all of it, and to the mesh's bounds,
  /// which are certified.
  DeferredProof(EdgeCollapse& collapse, BoundedMesh& mesh, std::span<const std::uint32_t> vertices,
                std::span<const std::uint32_t> faces, std::vector<std::uint32_t>& places);

  /// Boundary edges with bounds of their own are proved at once.
  bool possible() const;
  /// Before a collapse of the region is carried out.
  void note(const Change& change);
  /// Whether what the region has become keeps the bounds; if so, it is what further changes start from. O(faces and
  /// pieces of the reference there), about 0.1 us each.
  bool holds();
  /// Puts the region back as it was, when it does not hold.
  void take_back();

 private:
  std::uint32_t successor(std::uint32_t place) const;
  bool faces_hold();
  bool pieces_hold();

  EdgeCollapse& collapse_;
  BoundedMesh& mesh_;
  CertifiedBounds& bounds_;
  std::span<const std::uint32_t> vertices_, faces_;
  std::vector<std::uint32_t>& places_;
  const BoundedMesh::Saved saved_;
  const CertifiedBounds::Saved saved_bounds_;
  std::vector<Quadric> quadrics_;          ///< as they were
  std::vector<std::uint8_t> changed_;      ///< per face
  std::vector<std::uint32_t> successors_;  ///< per face: the place of the one that it was removed for, or its own
  std::vector<std::uint32_t> alive_;       ///< places of the faces that are left,
  std::vector<std::uint32_t> rank_;        ///< and per place, if it is one of them, where it stands among them
};

}  // namespace tolvol
