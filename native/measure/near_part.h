// SPDX-License-Identifier: GPL-3.0-or-later
/// The part of one mesh that can be nearest to a point of another. Without this cut, triangles that reach far away from
/// the other mesh would decide how large the frame is, and with it the rounding.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

/// Returns the box of the corners of the triangles. Throws Cancelled. O(m).
Box box_of(const TriangleMesh& mesh);

struct NearPart {
  /// A vertex on an edge of the mesh, at `share` of the way from the vertex `from` to the vertex `to`.
  struct Cut {
    std::uint32_t from, to;
    double share;

    /// The result errs by at most 4 u (geometry/frame.h) in a frame where |x| <= 1 at the result and at `from`.
    glm::dvec3 in(const Frame& frame, const TriangleMesh& mesh) const {
      const glm::dvec3 &p = mesh.vertices[from], &q = mesh.vertices[to];
      return frame.from_world(p) + share * ((q - p) * frame.scale());
    }
  };

  std::vector<glm::uvec3> triangles;  ///< index the vertices of the mesh, and after these `cuts`
  std::vector<Cut> cuts;
  bool whole = true;  ///< tells whether `triangles` are those of b
};

/// Returns triangles that lie on the triangles of b and hold every point of b that is nearest to some point of a. Some
/// vertex of b shows that such a point is within a distance R of the middle of a. Triangles within 40 R stay as they
/// are. A triangle with a corner within 8 R is cut between 24 R and 40 R, and what is beyond the cut is left out, as is
/// a triangle without such a corner, but only if a plane proves that it lies beyond R: a triangle stays if it passes a
/// while all its corners are far away, and what is beyond the cut stays if the triangle opens to more than about 170
/// degrees at the one near corner. Triangles that share an edge are cut at the same vertex of it, so that each edge
/// within R has the same faces as in b, in the same order of its ends. The meshes must be valid. O(n + m).
NearPart near_part(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace tolvol
