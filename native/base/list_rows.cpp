// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/list_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "base/call.h"
#include "base/errors.h"

namespace tolvol {
namespace {

template <class Number>
double number_at(const std::byte* place, std::endian order) {
  std::array<std::byte, sizeof(Number)> bytes;
  std::memcpy(bytes.data(), place, sizeof(Number));
  if (order != std::endian::native) std::reverse(bytes.begin(), bytes.end());
  return static_cast<double>(std::bit_cast<Number>(bytes));
}

double number_at(const std::byte* place, const StoredNumber& number) {
  using enum StoredNumber::Kind;
  const bool is_signed = number.kind == signed_integer;
  switch (number.size) {
    case 1:
      return is_signed ? number_at<std::int8_t>(place, number.order) : number_at<std::uint8_t>(place, number.order);
    case 2:
      return is_signed ? number_at<std::int16_t>(place, number.order) : number_at<std::uint16_t>(place, number.order);
    case 4:
      if (number.kind == floating) return number_at<float>(place, number.order);
      return is_signed ? number_at<std::int32_t>(place, number.order) : number_at<std::uint32_t>(place, number.order);
    default:
      return number_at<double>(place, number.order);
  }
}

}  // namespace

ListRows find_rows(std::span<const std::byte> data, std::size_t count, std::span<const RowProperty> properties) {
  ListRows rows{std::vector<std::vector<std::int64_t>>(properties.size()), std::vector<std::size_t>(properties.size()),
                0};
  std::size_t& at = rows.end;
  const auto require = [&](bool fits) {
    if (!fits) throw InvalidInput("the data end before the last of these rows");
  };
  for (std::size_t row = 0; row < count; ++row) {
    poll_at(row);
    for (std::size_t i = 0; i < properties.size(); ++i) {
      const RowProperty& property = properties[i];
      std::size_t length = 1;
      if (property.length) {
        require(property.length->size <= data.size() - at);
        const double declared = number_at(&data[at], *property.length);
        if (declared < 0 || declared != std::floor(declared)) {  // NaN differs from itself.
          throw InvalidInput("the length of a list is negative or not a whole number");
        }
        at += property.length->size;
        require(declared <= static_cast<double>(data.size() - at));
        length = static_cast<std::size_t>(declared);
        rows.lengths[i].push_back(static_cast<std::int64_t>(length));
      }
      require(length <= (data.size() - at) / property.size);
      at += length * property.size;
      rows.numbers[i] += length;
    }
  }
  return rows;
}

void copy_rows(std::span<const std::byte> data, std::size_t count, std::span<const RowProperty> properties,
               const ListRows& rows, std::span<std::byte* const> columns) {
  std::vector<std::byte*> to(columns.begin(), columns.end());
  const std::byte* from = data.data();
  for (std::size_t row = 0; row < count; ++row) {
    poll_at(row);
    for (std::size_t i = 0; i < properties.size(); ++i) {
      const bool is_list = properties[i].length.has_value();
      if (is_list) from += properties[i].length->size;
      const std::size_t bytes = properties[i].size * (is_list ? static_cast<std::size_t>(rows.lengths[i][row]) : 1);
      to[i] = std::copy_n(from, bytes, to[i]);
      from += bytes;
    }
  }
}

}  // namespace tolvol
