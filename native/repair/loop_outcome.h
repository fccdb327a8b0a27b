// SPDX-License-Identifier: GPL-3.0-or-later
/// What becomes of a boundary loop whose hole is to be closed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tolvol {

/// If several of `outside`, `turned` and `crossing` keep a loop open, the outcome is the one that refused most of the
/// faces and edges that the last search tried, and of equals the first. `non_manifold` and `degenerate` are outcomes
/// only of loops that none of these three keeps open.
enum class LoopOutcome : std::uint8_t {
  closed,
  not_a_loop,    ///< the open edges end at triangles of the other orientation or at an edge of more than two triangles
  too_long,      ///< it has more than kMostLoopCorners corners
  perimeter,     ///< it is longer than CloseHolesOptions::largest_perimeter
  outside,       ///< it is not proved that the faces would be within the tolerance
  turned,        ///< the faces would be turned away from the reference, or rounding could turn them
  crossing,      ///< the faces would cross others
  non_manifold,  ///< an edge would be one of more than two triangles
  degenerate,    ///< the faces would be segments
  given_up,      ///< the search ended at one of its limits (repair/filling.cpp): there may be a filling
};

inline constexpr std::array kLoopOutcomeNames = {"closed", "not_a_loop", "too_long",     "perimeter",  "outside",
                                                 "turned", "crossing",   "non_manifold", "degenerate", "given_up"};
inline const char* name_of(LoopOutcome outcome) { return kLoopOutcomeNames[static_cast<std::size_t>(outcome)]; }

}  // namespace tolvol
