// SPDX-License-Identifier: GPL-3.0-or-later
/// Moves all free vertices of a patch together, and flips its edges, to where points of the reference are near the
/// patch's faces and points of these faces near the reference (PatchDeviations). The largest deviations count most. It
/// steers a search and proves nothing.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "decimation/refinement/damped_system.h"
#include "decimation/refinement/edge_flips.h"
#include "decimation/refinement/patch.h"
#include "decimation/refinement/patch_deviations.h"

namespace tolvol {

/// Changes the patch of the deviations that it is given, which are renewed, and leaves these renewed.
class Relaxation {
 public:
  /// Minimises the sum of deviations to the power of 8 by at most so many steps. If `flip`, it flips edges, too.
  /// Before some of its steps it gives up, and returns false, if the largest deviation is beyond what a success has
  /// been seen to come from.
  bool lower_sum(PatchDeviations& deviations, int steps, bool flip);
  /// Minimises the sum of deviations to the power of 24 by at most so many steps, and then of a still higher power,
  /// which lowers the largest one. It flips edges, too.
  void lower_largest(PatchDeviations& deviations, int steps);
  /// The same, but gives up like lower_sum(), for points that were added in a state that was enough without them.
  void try_lower_largest(PatchDeviations& deviations, int steps);

 private:
  void lower_largest(PatchDeviations& deviations, int steps, std::span<const double> give_up_above,
                     std::span<const double> give_up_at_last);
  void minimise(PatchDeviations& deviations, int steps, bool flip, std::span<const double> give_up_above);
  void number_unknowns(const Patch& patch);
  bool step(PatchDeviations& deviations, bool look_around);
  void assemble(const PatchDeviations& deviations);
  bool place_unturned(Patch& patch, std::vector<glm::dvec3>& places);
  bool find_turned(const Patch& patch);

  EdgeFlips flips_;
  DampedSystem system_;
  std::vector<std::uint32_t> unknown_;  ///< For each vertex: its place among the free ones, or kNone.
  std::vector<std::uint32_t> free_;     ///< The free vertices.
  std::vector<glm::dvec3> before_, normals_, new_normals_;
  std::vector<bool> turned_;
  double damping_ = 0, overstep_ = 0;
};

}  // namespace tolvol
