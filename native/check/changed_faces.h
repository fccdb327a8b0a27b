// SPDX-License-Identifier: GPL-3.0-or-later
/// What a change of a mesh would leave, as plain data for whoever decides about it: the faces that get another shape,
/// those that vanish, the vertex that moves, and the boundary. Everything is in the volume's frame unless it says so.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "check/coverage.h"
#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

class ChangedFaces {
 public:
  /// A face as the change would leave it; its corners are in Coverage::Element.
  struct Face {
    bool moves;  ///< Whether its corner number `corner` moves.
    int corner;
    glm::dvec3 before;  ///< Where the corner is before.
    std::uint32_t vertices[3];
  };
  /// What a collapse of a boundary edge does to the boundary. Its elements are boundary edges (a, b, b), named by their
  /// first vertex.
  struct Boundary {
    std::vector<Coverage::Element> elements;
    std::vector<Coverage::Removed> removed;
    bool lies_on_others = false;  ///< Whether a new edge might lie on those of other sheets, and be no boundary then.
  };

  /// The mesh as it is, with the triangles that are gone. Elements are named by its triangles.
  const MeshView& before() const { return before_; }
  const std::vector<Coverage::Element>& elements() const { return elements_; }
  const std::vector<Face>& faces() const { return faces_; }  ///< In the order of elements().
  const std::vector<Coverage::Removed>& removed() const { return removed_; }
  /// The vertex that a collapse leaves or that a relocation moves; none of a flip.
  std::optional<std::uint32_t> vertex() const { return vertex_; }
  /// Where that vertex goes.
  const VertexPosition& position() const { return position_; }
  /// The copies of the vertex that vanishes in a collapse that move along with it and become copies of vertex().
  const std::vector<std::uint32_t>& carried() const { return carried_; }
  /// The copies of vertex(), without those that are carried, that move along with it.
  const std::vector<std::uint32_t>& moved_along() const { return moved_along_; }
  /// How much of the forward bound the vertex may use, and the points of a face.
  double share() const { return share_; }
  double share(const Face& face) const {
    double least = share_;
    if (shares_.empty()) return least;
    for (const std::uint32_t v : face.vertices) least = std::min(least, shares_[v]);
    return least;
  }
  /// The boundary edges as a collapse would leave them; none of another change.
  const Boundary& boundary() const { return boundary_; }

 protected:
  /// `shares`: for each vertex, how much of the forward bound new faces around it may use; empty if it is 1 for each.
  ChangedFaces(const MeshView& before, std::span<const double> shares) : before_(before), shares_(shares) {}

  MeshView before_;
  std::span<const double> shares_;
  std::vector<Coverage::Element> elements_;
  std::vector<Face> faces_;
  std::vector<Coverage::Removed> removed_;
  std::optional<std::uint32_t> vertex_;
  VertexPosition position_{};
  std::vector<std::uint32_t> carried_, moved_along_;
  double share_ = 1;
  Boundary boundary_;
};

}  // namespace tolvol
