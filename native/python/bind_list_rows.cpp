// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/list_rows.h"
#include "python/arrays.h"
#include "python/interruptible.h"
#include "python/module.h"

namespace tolvol::python {
namespace {

using Types = std::vector<std::pair<std::optional<std::string>, std::string>>;

/// Takes the name of a number type, as NumPy writes it.
py::dtype to_number_type(const std::string& name) {
  const InvalidInput wrong("types must name integers of 1, 2 or 4 bytes or floats of 4 or 8 bytes, and one is " + name);
  try {
    const py::dtype type(name);
    const bool is_floating = type.kind() == 'f' && (type.itemsize() == 4 || type.itemsize() == 8);
    if (!is_floating && !((type.kind() == 'i' || type.kind() == 'u') && type.itemsize() <= 4)) throw wrong;
    return type;
  } catch (const py::error_already_set&) {  // NumPy knows no such type.
    throw wrong;
  }
}

StoredNumber to_stored_number(const std::string& name) {
  using enum StoredNumber::Kind;
  const py::dtype type = to_number_type(name);
  // NumPy writes = for the order of this machine, and | where there is only one.
  const char order = type.attr("byteorder").cast<char>();
  return {type.kind() == 'i'   ? signed_integer
          : type.kind() == 'u' ? unsigned_integer
                               : floating,
          static_cast<std::size_t>(type.itemsize()),
          order == '>'   ? std::endian::big
          : order == '<' ? std::endian::little
                         : std::endian::native};
}

py::tuple list_rows(const py::buffer& data, std::int64_t count, const Types& types, std::int64_t offset) {
  const py::buffer_info info = data.request();
  if (info.itemsize != 1 || info.ndim != 1 || info.strides[0] != 1) throw InvalidInput("data must be bytes");
  if (offset < 0 || offset > info.size) throw InvalidInput("offset must be a place in data");
  if (count < 0) throw InvalidInput("count must not be negative");
  if (types.empty()) throw InvalidInput("types must name at least one type");
  const auto bytes = std::span(static_cast<const std::byte*>(info.ptr), static_cast<std::size_t>(info.size))
                         .subspan(static_cast<std::size_t>(offset));
  const auto number = static_cast<std::size_t>(count);
  std::vector<py::dtype> stored;
  std::vector<RowProperty> properties;
  for (const auto& [length, type] : types) {
    stored.push_back(to_number_type(type));
    properties.push_back({static_cast<std::size_t>(stored.back().itemsize()),
                          length ? std::optional(to_stored_number(*length)) : std::nullopt});
  }
  ListRows rows;
  {
    const Interruptible call;
    rows = find_rows(bytes, number, properties);
  }
  std::vector<py::array> columns;
  std::vector<std::byte*> places;
  for (std::size_t i = 0; i < types.size(); ++i) {
    columns.emplace_back(stored[i], static_cast<py::ssize_t>(rows.numbers[i]));
    places.push_back(static_cast<std::byte*>(columns.back().mutable_data()));
  }
  {
    const Interruptible call;
    copy_rows(bytes, number, properties, rows, places);
  }
  py::list found;
  for (std::size_t i = 0; i < types.size(); ++i) {
    if (properties[i].length) {
      found.append(py::make_tuple(columns[i], from_vector<std::int64_t>(rows.lengths[i])));
    } else {
      found.append(columns[i]);
    }
  }
  return py::make_tuple(found, offset + static_cast<std::int64_t>(rows.end));
}

}  // namespace

void bind_list_rows(py::module_& module) {
  module.def("list_rows", &list_rows, py::arg("data"), py::arg("count"), py::arg("types"), py::kw_only(),
             py::arg("offset") = 0,
             R"doc(Take apart rows of bytes that hold numbers and lists of different lengths, as binary PLY files do.

Parameters
----------
data : bytes-like
count : int
    The number of rows.
types : sequence of (str or None, str)
    What stands in each row, by names of NumPy's types such as "<i4" and "u1": (None, type) is a number, and
    (type of the length, type) a list of numbers after its length. Integers have 1, 2 or 4 bytes, floats 4 or 8.
offset : int
    The byte at which the first row begins.

Returns
-------
columns : list
    For each type an array of its numbers, in the type that was given: (count,) for a number; for a list the pair of the
    entries of one list after another, and of the lengths, (count,) int64.
end : int
    The byte after the last row.

Raises
------
InvalidInput
    If the data end before the last row does, a length is negative or not a whole number, or an argument is wrong.

The memory that the call takes grows with the data, whatever `count` is. A row takes about 0.01 us.)doc");
}

}  // namespace tolvol::python
