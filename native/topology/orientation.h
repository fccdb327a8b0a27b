// SPDX-License-Identifier: GPL-3.0-or-later
/// Which triangles look to the same side of a surface.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "base/parallel.h"

namespace tolvol {

struct Orientation {
  std::vector<std::uint32_t> part;  ///< For each triangle: the first triangle of its connected part.
  std::vector<bool> reversed;       ///< For each triangle: whether it looks to the other side than that one does.
};

/// Triangles are connected by edges of two triangles. A triangle with a repeated corner is a part of its own. On a part
/// with one side, as of a Moebius strip, the way in which it is found decides. About 0.3 us a triangle.
Orientation orientation(std::span<const glm::uvec3> triangles, std::size_t vertices, Team& team);

}  // namespace tolvol
