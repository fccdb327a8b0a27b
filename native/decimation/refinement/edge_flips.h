// SPDX-License-Identifier: GPL-3.0-or-later
/// Flips edges of a patch where that brings it nearer to the points of the reference near by.
#pragma once

#include <cstdint>
#include <vector>

#include "decimation/refinement/patch.h"
#include "decimation/refinement/patch_deviations.h"

namespace tolvol {

class EdgeFlips {
 public:
  /// Flips the edges of the patch of `deviations` whose flip lowers the energy of the points of the reference near by,
  /// folds nothing and is possible. Returns whether there are any, and renews the deviations then.
  bool flip(PatchDeviations& deviations);
  /// Flips the edge at `place` among the edges of faces around a vertex whose flip folds nothing and is possible,
  /// whatever becomes of the energy. Returns false if there are not so many.
  static bool flip_near(PatchDeviations& deviations, std::uint32_t vertex, int place);

 private:
  double energy_now(const PatchDeviations& deviations, const Patch::Flipped& flipped) const;
  double energy_if(const PatchDeviations& deviations, const Patch::Flipped& flipped, double limit) const;

  std::vector<std::vector<std::uint32_t>> points_of_;  ///< For each face: the points that are nearest to it.
};

}  // namespace tolvol
