// SPDX-License-Identifier: GPL-3.0-or-later
/// The messages of all operations about input for which they cannot keep their promise.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "check/facing.h"
#include "check/outside.h"
#include "check/tolerance_volume.h"
#include "geometry/frame.h"

namespace tolvol {

/// Returns a warning if the stored type rounds these coordinates by more than 1 % of the tolerance. Throws InvalidInput
/// if it rounds them by more than 50 %. `space` must be in the volume's frame.
std::optional<std::string> storage_warning(const ToleranceVolume& volume, const StoredSpace& space,
                                           std::span<const glm::dvec3> stored);

/// Throws FacesOutside: faces of the input are not inside. `outside` must not be empty.
[[noreturn]] void refuse_outside(const FaceCount& outside);

/// Takes faces of the reference that are not within the tolerance of the input as `outside` says: throws FacesOutside,
/// or returns a warning. `uncovered` must not be empty.
std::string take_uncovered(const FaceCount& uncovered, Outside outside);

/// Throws InvalidInput for faces of fewer than 3 corners, which have no area.
void require_area_to_cover(int corners);

/// Throws InvalidInput unless the angle, in degrees, is more than 0 and at most 180.
void require_normal_angle(double degrees);

/// Returns the rule that keeps this angle for a mesh whose mapping error is `mesh_error`. Returns none for 180 degrees,
/// which keep no angle, and adds a warning and returns none where hardly any face would find a witness.
std::optional<FacingRule> facing_rule(const ToleranceVolume& volume, double mesh_error, double degrees,
                                      std::vector<std::string>& warnings, Team& team);

}  // namespace tolvol
