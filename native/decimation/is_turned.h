// SPDX-License-Identifier: GPL-3.0-or-later
/// Whether a change of a face turns its normal too far.
#pragma once

#include <glm/glm.hpp>

namespace tolvol {

/// Whether the angle between two normals, of any lengths, is larger than that of a cosine, which is more than 0. It is
/// if one of them has no direction.
inline bool is_turned(const glm::dvec3& before, const glm::dvec3& after, double cosine) {
  const double dot = glm::dot(before, after);
  return !(dot > 0 && dot * dot >= cosine * cosine * glm::dot(before, before) * glm::dot(after, after));
}

}  // namespace tolvol
