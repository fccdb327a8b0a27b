// SPDX-License-Identifier: GPL-3.0-or-later
/// Takes apart rows of bytes in which lists of different lengths stand among numbers, as binary PLY files hold them.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tolvol {

/// How a number is stored.
struct StoredNumber {
  enum class Kind { signed_integer, unsigned_integer, floating };
  Kind kind;
  std::size_t size;  ///< in bytes: 1, 2 or 4 of an integer, 4 or 8 of a floating number
  std::endian order = std::endian::native;
};

/// One number of each row, or a list of numbers after its length.
struct RowProperty {
  std::size_t size;                    ///< of each number, in bytes
  std::optional<StoredNumber> length;  ///< of the list; nothing for one number
};

struct ListRows {
  std::vector<std::vector<std::int64_t>>
      lengths;                       ///< for each property that of the list in each row; empty for numbers
  std::vector<std::size_t> numbers;  ///< for each property how many numbers it has in all rows
  std::size_t end;                   ///< the byte after the last row
};

/// Finds `count` rows at the beginning of `data`. Throws InvalidInput if the data end before the last row does, or if a
/// length is negative or not whole, and Cancelled. The memory that it takes grows with the data, whatever `count` is.
/// There is at least one property.
ListRows find_rows(std::span<const std::byte> data, std::size_t count, std::span<const RowProperty> properties);

/// Copies what find_rows() has found to one column for each property, bytes as they are: all numbers of the first row,
/// then those of the next. A column has room for `numbers`. Throws Cancelled.
void copy_rows(std::span<const std::byte> data, std::size_t count, std::span<const RowProperty> properties,
               const ListRows& rows, std::span<std::byte* const> columns);

}  // namespace tolvol
