// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/input_checks.h"

#include <cmath>
#include <iomanip>
#include <sstream>

#include "base/errors.h"

namespace tolvol {

/// No more than this share of the tolerance is left to rounding.
constexpr double kMostRounding = 0.5;

std::optional<std::string> storage_warning(const ToleranceVolume& volume, const StoredSpace& space,
                                           std::span<const glm::dvec3> stored) {
  const double share = space.storage_step(stored) / volume.frame_tolerance();
  std::ostringstream text;
  if (share > kMostRounding) {
    // The frame's tolerance leaves a little out for the mapping to the world. A tenth more makes up for that.
    text << "the tolerance is too small for coordinates of this size and type, which are rounded: take at least "
         << std::ceil(11 * share / kMostRounding) / 10
         << " times this tolerance, or move the mesh nearer to its origin";
    throw InvalidInput(text.str(), "tolerance_too_small");
  }
  if (share <= 0.01) return std::nullopt;
  text << "coordinates of this size and type are rounded by up to " << std::setprecision(2) << 100 * share
       << " % of the tolerance; move the mesh nearer to its origin, or take a larger tolerance";
  return text.str();
}

void refuse_outside(const FaceCount& outside) {
  std::ostringstream text;
  text << outside.faces << " faces are not within the tolerance of the reference, the first is face " << *outside.first
       << "; take a larger tolerance, set the reference anew, or keep them (outside=\"keep\")";
  throw FacesOutside(outside.faces, *outside.first, text.str(), "input_outside");
}

std::string take_uncovered(const FaceCount& uncovered, Outside outside) {
  std::ostringstream text;
  if (outside == Outside::keep) {
    text << uncovered.faces << " faces of the reference are partly or wholly beyond the tolerance of the mesh, as they "
         << "were before; what is nearest to them was kept";
    return text.str();
  }
  text << uncovered.faces << " faces of the reference are not within the tolerance of the mesh, the first is face "
       << *uncovered.first << "; take a larger tolerance, set the reference anew, keep one direction only "
       << "(two_sided=False), or go on from what there is (outside=\"keep\")";
  throw FacesOutside(uncovered.faces, *uncovered.first, text.str(), "reference_outside");
}

void require_area_to_cover(int corners) {
  if (corners >= 3) return;
  throw InvalidInput("points and segments cannot cover a reference; keep one direction only (two_sided=False)");
}

void require_normal_angle(double degrees) {
  if (degrees > 0 && degrees <= 180) return;
  throw InvalidInput("max_normal_angle must be more than 0 and at most 180 degrees");
}

std::optional<FacingRule> facing_rule(const ToleranceVolume& volume, double mesh_error, double degrees,
                                      std::vector<std::string>& warnings, Team& team) {
  if (degrees >= 180) return std::nullopt;
  FacingRule rule(volume.reference(), volume.mapping_error(), mesh_error, glm::radians(degrees), team);
  if (2 * rule.unsure <= rule.normals.size()) {
    rule.bound_normals(volume.hierarchy(), team);
    return rule;
  }
  warnings.push_back(
      "no angle of normals is kept: rounding could turn most faces of the reference, which are too small or too thin "
      "for its size; take the small parts as a mesh of their own");
  return std::nullopt;
}

}  // namespace tolvol
