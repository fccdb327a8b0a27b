// SPDX-License-Identifier: GPL-3.0-or-later
/// The part of one mesh that can be nearest to a point of another: triangles that reach far away from it would
/// otherwise decide how large the frame is, and with it the rounding.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"

namespace tolvol {

struct NearPart {
  /// A vertex on an edge of the mesh: `share` of the way from the vertex `from` to the vertex `to`.
  struct Cut {
    std::uint32_t from, to;
    double share;

    /// Errs by at most 4 u (geometry/frame.h) in a frame where |x| <= 1 at the result and at `from`.
    glm::dvec3 in(const Frame& frame, const TriangleMesh& mesh) const {
      const glm::dvec3 &p = mesh.vertices[from], &q = mesh.vertices[to];
      return frame.from_world(p) + share * ((q - p) * frame.scale());
    }
  };

  std::vector<glm::uvec3> triangles;  ///< of the vertices of the mesh, and after these of `cuts`
  std::vector<Cut> cuts;
};

/// Triangles that lie on those of b and hold every point of b that is nearest to some point of a. Let R be how far such
/// a point can be from the middle of a, as some vertex of b shows. Triangles within 40 R stay as they are. A triangle
/// with a corner within 8 R is cut off between 24 R and 40 R; one without is left out. Both only where the rest is
/// proved to lie beyond R, by a plane: a triangle stays whole when it passes a while all its corners are far away, or
/// when one corner is near and it opens to more than about 170 degrees there. The meshes are valid. O(n + m).
NearPart near_part(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace tolvol
