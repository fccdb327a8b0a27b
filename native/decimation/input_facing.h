// SPDX-License-Identifier: GPL-3.0-or-later
/// How the input of a decimation faces its reference, which decides what its faces have to keep.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "check/certificate.h"
#include "check/facing.h"
#include "decimation/certified_bounds.h"
#include "geometry/hierarchy.h"
#include "topology/manifold_cut.h"

namespace tolvol {

/// Turns the normals of a rule to where the triangles of the manifold face that its reference was cut to. Triangles
/// that the cut dropped or set aside are no witnesses; what covers their points is. `hierarchy` is the reference's.
/// O(m).
void face_as_cut(const CutMesh& cut, const Hierarchy& hierarchy, Team& team, FacingRule& rule);

/// What was found of the faces of a mesh.
struct InputFacing {
  std::vector<std::uint32_t> exceeding;  ///< The faces without a proof that they keep the angle of the rule, ascending.
  /// For each face whether a proof of some angle was found, which also proves that the face is within the tolerance.
  std::vector<std::uint8_t> proved;
};

/// Looks at the faces of a mesh that is not its reference, and sets their rules. A connected part is compared by its
/// other side if, over more of its area, all triangles of the reference near a face look against it than all look as it
/// does. Then the faces keep their angles. `certificate` decides which points are within the tolerance; `hierarchy` is
/// of its reference. Returns what keep_angles() does. About 3 us a triangle.
InputFacing face_as_reference(const CutMesh& cut, std::span<const glm::dvec3> positions,
                              const TriangleCertificate& certificate, const Hierarchy& hierarchy,
                              const FacingRule& rule, Team& team, CertifiedBounds& bounds, Progress* progress);

/// Sets the rules of some faces. A face without a proof that it keeps the angle of the rule keeps the least angle that
/// is proved for it, to within a degree; a face that looks against all triangles near it is free of the rule. `hints`
/// are triangles of the reference near each face, or empty.
InputFacing keep_angles(const CutMesh& cut, std::span<const glm::dvec3> positions,
                        const TriangleCertificate& certificate, const FacingRule& rule,
                        std::span<const std::uint32_t> faces, Team& team, CertifiedBounds& bounds, Progress* progress,
                        std::span<const std::uint32_t> hints = {});

}  // namespace tolvol
