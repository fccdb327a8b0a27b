// SPDX-License-Identifier: GPL-3.0-or-later
/// Input that is beyond the tolerance before an operation begins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tolvol {

/// What an operation does with such input.
enum class Outside {
  error,  ///< It throws FacesOutside.
  keep,   ///< Faces that are outside, and faces nearest to parts of the reference that are uncovered, stay as they are.
};

/// The number of some faces, and the first of them.
struct FaceCount {
  std::size_t faces = 0;
  std::optional<std::uint32_t> first;

  /// Counts these faces, whose numbers ascend.
  static FaceCount of(std::span<const std::uint32_t> numbers) {
    if (numbers.empty()) return {};
    return {numbers.size(), numbers.front()};
  }
};

}  // namespace tolvol
