// SPDX-License-Identifier: GPL-3.0-or-later
/// What every operation says about input that it cannot keep its promise for.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>

#include "check/tolerance_volume.h"
#include "geometry/frame.h"

namespace tolvol {

/// What the stored type costs at these coordinates: a warning from 1 % of the tolerance on; throws InvalidInput from 50
/// % on. `space` is in the volume's frame.
std::optional<std::string> storage_warning(const ToleranceVolume& volume, const StoredSpace& space,
                                           std::span<const glm::dvec3> stored);

/// Throws FacesOutside: faces of the input are not inside.
[[noreturn]] void refuse_outside(std::size_t count, std::uint32_t first);

}  // namespace tolvol
