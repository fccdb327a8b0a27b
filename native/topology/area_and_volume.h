// SPDX-License-Identifier: GPL-3.0-or-later
/// The area of a mesh and the volume that it encloses, wherever its shells are and however large they are.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

namespace tolvol {

struct AreaAndVolume {
  double area = 0;  ///< 0 or infinite beyond the range of double
  /// Negative if the faces run the other way round. It means nothing if the mesh is not closed. It is 0 or infinite
  /// beyond the range of double, and 0 for a body that is flatter than that range has room for.
  double volume = 0;
};

/// `shell_of`: for each triangle, a triangle of its shell, the same one for all of the shell (Solidity::shell_of).
/// `linear` maps stored coordinates to the world, apart from a translation, which changes nothing; a mirror does not
/// change the sign of the volume. The mesh must be valid. Each shell is measured from a corner of its own, so that the
/// distance between shells costs no digits. O(m).
AreaAndVolume area_and_volume(std::span<const glm::dvec3> stored, std::span<const glm::uvec3> triangles,
                              std::span<const std::uint32_t> shell_of, const glm::dmat3& linear);

}  // namespace tolvol
