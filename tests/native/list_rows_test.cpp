// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/list_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <random>

#include "base/errors.h"
#include "polls.h"

namespace {

using namespace tolvol;
using Kind = StoredNumber::Kind;
using Bytes = std::vector<std::byte>;

constexpr std::endian kOther = std::endian::native == std::endian::little ? std::endian::big : std::endian::little;

template <class Number>
void append(Bytes& bytes, Number number, std::endian order = std::endian::native) {
  std::array<std::byte, sizeof(Number)> stored;
  std::memcpy(stored.data(), &number, sizeof(Number));
  if (order != std::endian::native) std::reverse(stored.begin(), stored.end());
  bytes.insert(bytes.end(), stored.begin(), stored.end());
}

/// Bytes of a list's length, and how it is stored.
struct Length {
  Bytes bytes;
  StoredNumber stored;
};

template <class Number>
Length length_of(Number value, std::endian order) {
  const Kind kind = !std::numeric_limits<Number>::is_integer ? Kind::floating
                    : std::numeric_limits<Number>::is_signed ? Kind::signed_integer
                                                             : Kind::unsigned_integer;
  Length length{{}, {kind, sizeof(Number), order}};
  append(length.bytes, value, order);
  return length;
}

std::vector<Length> in_all_types(int value) {
  std::vector<Length> found;
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    found.push_back(length_of(static_cast<std::int8_t>(value), order));
    found.push_back(length_of(static_cast<std::uint8_t>(value), order));
    found.push_back(length_of(static_cast<std::int16_t>(value), order));
    found.push_back(length_of(static_cast<std::uint16_t>(value), order));
    found.push_back(length_of(static_cast<std::int32_t>(value), order));
    found.push_back(length_of(static_cast<std::uint32_t>(value), order));
    found.push_back(length_of(static_cast<float>(value), order));
    found.push_back(length_of(static_cast<double>(value), order));
  }
  return found;
}

/// Rows of a number of two bytes, a list of numbers of four, a list of bytes and a double.
struct Mixed {
  Bytes bytes;
  std::vector<RowProperty> properties = {{2, {}},
                                         {4, StoredNumber{Kind::unsigned_integer, 1}},
                                         {1, StoredNumber{Kind::signed_integer, 2, kOther}},
                                         {8, {}}};
  std::vector<std::vector<std::int64_t>> lengths = {{}, {}, {}, {}};
  std::vector<Bytes> columns = {{}, {}, {}, {}};
  std::size_t count;

  explicit Mixed(std::size_t rows) : count(rows) {
    std::mt19937 engine(1);
    const auto add = [&](std::size_t column, auto number) {
      append(bytes, number);
      append(columns[column], number);
    };
    for (std::size_t row = 0; row < rows; ++row) {
      add(0, static_cast<std::uint16_t>(engine()));
      lengths[1].push_back(engine() % 6);
      append(bytes, static_cast<std::uint8_t>(lengths[1].back()));
      for (int i = 0; i < lengths[1].back(); ++i) add(1, static_cast<std::uint32_t>(engine()));
      lengths[2].push_back(engine() % 300);
      append(bytes, static_cast<std::int16_t>(lengths[2].back()), kOther);
      for (int i = 0; i < lengths[2].back(); ++i) add(2, static_cast<std::uint8_t>(engine()));
      add(3, static_cast<double>(engine()));
    }
  }
};

std::vector<Bytes> copied_rows(const Mixed& mixed, const ListRows& rows) {
  std::vector<Bytes> columns;
  std::vector<std::byte*> places;
  for (std::size_t i = 0; i < mixed.properties.size(); ++i) {
    columns.emplace_back(rows.numbers[i] * mixed.properties[i].size);
  }
  for (Bytes& column : columns) places.push_back(column.data());
  copy_rows(mixed.bytes, mixed.count, mixed.properties, rows, places);
  return columns;
}

TEST(ListRows, AreFoundAndCopiedWithWhatStandsBesideThem) {
  for (const std::size_t count : {0, 1, 2, 100}) {
    Mixed mixed(count);
    const std::size_t end = mixed.bytes.size();
    mixed.bytes.resize(end + 5);  // What follows the rows is not theirs.
    const ListRows rows = find_rows(mixed.bytes, count, mixed.properties);
    EXPECT_EQ(rows.end, end);
    EXPECT_EQ(rows.lengths, mixed.lengths);
    EXPECT_EQ(copied_rows(mixed, rows), mixed.columns);
  }
}

TEST(ListRows, LengthsHaveAnyTypeAndOrder) {
  for (const Length& length : in_all_types(3)) {
    Bytes bytes = length.bytes;
    bytes.resize(bytes.size() + 3 * 8);
    const std::vector<RowProperty> properties = {{8, length.stored}};
    const ListRows rows = find_rows(bytes, 1, properties);
    EXPECT_EQ(rows.lengths[0], std::vector<std::int64_t>{3});
    EXPECT_EQ(rows.numbers[0], 3u);
    EXPECT_EQ(rows.end, bytes.size());
  }
}

TEST(ListRows, AreRefusedWhereverTheDataEnd) {
  const Mixed mixed(3);
  for (std::size_t end = 0; end < mixed.bytes.size(); ++end) {
    const Bytes cut(mixed.bytes.begin(), mixed.bytes.begin() + static_cast<std::ptrdiff_t>(end));
    EXPECT_THROW(find_rows(cut, mixed.count, mixed.properties), InvalidInput) << end;
  }
}

TEST(ListRows, LengthsThatNoListHasAreRefused) {
  const auto refused = [](auto value) {
    Length length = length_of(value, std::endian::native);
    length.bytes.resize(length.bytes.size() + 100);
    const std::vector<RowProperty> properties = {{2, length.stored}};
    EXPECT_THROW(find_rows(length.bytes, 1, properties), InvalidInput) << value;
  };
  refused(std::int8_t{-1});
  refused(std::numeric_limits<std::int32_t>::min());
  refused(std::uint8_t{51});  // Two bytes for each do not fit, though as many bytes would.
  refused(std::numeric_limits<std::uint32_t>::max());
  refused(2.5f);
  refused(-0.5);
  refused(1e300);
  refused(std::numeric_limits<float>::infinity());
  refused(std::numeric_limits<double>::quiet_NaN());
}

TEST(ListRows, ACountThatLiesTakesNoMemory) {
  const Mixed mixed(2);
  EXPECT_THROW(find_rows(mixed.bytes, std::numeric_limits<std::size_t>::max(), mixed.properties), InvalidInput);
}

TEST(ListRows, AreCancelledAtEachPoll) {
  const Mixed mixed(10000);
  const auto run = [&] { copied_rows(mixed, find_rows(mixed.bytes, mixed.count, mixed.properties)); };
  const std::size_t polls = polls_of(run);
  EXPECT_GE(polls, 4u);
  for (std::size_t last = 1; last <= polls; ++last) {
    const Counted counted(last);
    EXPECT_THROW(run(), Cancelled);
  }
}

}  // namespace
