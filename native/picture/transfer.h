// SPDX-License-Identifier: GPL-3.0-or-later
/// The colours of distances.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace tolvol {

/// signed_distance goes from -tolerance (inside the reference), blue, over grey to the tolerance, red. magnitude goes
/// from 0 to the tolerance.
enum class Transfer { signed_distance, magnitude };

/// Returns `count` (at least 2) colours at equal steps from one end of the range to the other, with 8 bits a channel.
/// Both maps are perceptually even and readable for the colour-blind: the diverging "cool to warm" of [K. Moreland,
/// Diverging Color Maps for Scientific Visualization, ISVC 2009] and "viridis" of [S. van der Walt, N. Smith,
/// matplotlib 1.5, 2015].
std::vector<glm::u8vec3> transfer_colours(Transfer transfer, std::size_t count);

/// Pictures and legends use this number of colours.
inline constexpr std::size_t kTransferColours = 256;

/// A place out of tolerance is marked by stripes of these two colours, which no colour map has.
inline constexpr glm::u8vec3 kOutsideColour{236, 0, 140}, kOutsideStripe{84, 0, 62};

}  // namespace tolvol
