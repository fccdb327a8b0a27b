// SPDX-License-Identifier: GPL-3.0-or-later
/// Regions of a mesh that can be worked on at once: compact groups of vertices, of about equal size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "decimation/bounded_mesh.h"

namespace tolvol {

class Regions {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  /// Cuts along the longest axis at a median, over and over, until no region has more than `most` vertices. The first
  /// cut is at `first` of the vertices instead, by which the rims come to lie elsewhere. O(n log n); the same
  /// everywhere, on any number of threads.
  Regions(const BoundedMesh& mesh, std::size_t most, double first, Team& team);

  std::uint32_t count() const { return static_cast<std::uint32_t>(cells_.size()); }

  /// The region that a vertex and all its neighbours belong to. It is kNone at the rim of a region and for
  /// joined vertices. As long as only edges of a region collapse, nothing that a collapse changes or
  /// looks at in the connectivity is changed by another region's.
  std::uint32_t of_vertex(std::uint32_t vertex) const { return of_vertex_[vertex]; }
  /// The region of an edge: that of its two ends.
  std::uint32_t of_edge(const BoundedMesh& mesh, std::uint32_t edge) const;

  /// The box of stored positions that holds the region's vertices and their neighbours. The cells of two regions have
  /// no inner point in common. As long as changes put vertices strictly inside their cell alone, faces that one region
  /// changes meet those that another changes only where they met before: what a face has in common with the border of
  /// the cell is spanned by its vertices there, and a change only takes some of these away.
  const Box& cell(std::uint32_t region) const { return cells_[region]; }
  /// Calls visit(region) for those whose cell meets a box of stored positions.
  template <class Visit>
  void for_each_meeting(const Box& box, Visit&& visit) const;

 private:
  /// A node of the tree of cuts. The cut is across `axis` at `at`; the parts are the nodes `below` and `below + 1`.
  struct Node {
    int axis = 0;
    double at = 0;
    std::uint32_t below = kNone;  ///< If this is kNone, the node is not cut and is the region `region`.
    std::uint32_t region = kNone;
  };

  template <class Visit>
  void visit_meeting(const Node& node, const Box& box, Visit& visit) const;
  void cut(const BoundedMesh& mesh, std::vector<std::uint32_t>& vertices, std::size_t most, double first, Team& team);

  std::vector<std::uint32_t> of_vertex_;
  std::vector<Box> cells_;
  std::vector<Node> nodes_;
};

template <class Visit>
void Regions::for_each_meeting(const Box& box, Visit&& visit) const {
  visit_meeting(nodes_[0], box, visit);
}

template <class Visit>
void Regions::visit_meeting(const Node& node, const Box& box, Visit& visit) const {
  if (node.below == kNone) return visit(node.region);
  if (box.lower[node.axis] <= node.at) visit_meeting(nodes_[node.below], box, visit);
  if (box.upper[node.axis] >= node.at) visit_meeting(nodes_[node.below + 1], box, visit);
}

}  // namespace tolvol
