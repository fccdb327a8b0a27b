// SPDX-License-Identifier: GPL-3.0-or-later
/// Refuses positions that are not finite.
#pragma once

#include <cmath>
#include <cstddef>
#include <glm/glm.hpp>
#include <sstream>
#include <string>

#include "base/errors.h"

namespace tolvol {

inline bool finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

/// Throws InvalidInput that names a vertex, says `what` is wrong with its position p, and has this code.
[[noreturn]] inline void refuse(const std::string& name, std::size_t vertex, const glm::dvec3& p, const char* what,
                                const char* code) {
  std::ostringstream text;
  text << name << " " << vertex << " " << what << " (" << p.x << ", " << p.y << ", " << p.z << ")";
  throw InvalidInput(text.str(), code);
}

}  // namespace tolvol
