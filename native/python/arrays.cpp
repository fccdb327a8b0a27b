// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/arrays.h"

#include <pybind11/stl.h>

#include <limits>
#include <sstream>

#include "base/errors.h"

namespace tolvol::python {
namespace {

std::string shape_of(const py::array& array) {
  std::ostringstream text;
  text << "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) text << (i ? ", " : "") << array.shape(i);
  text << ")";
  return text.str();
}

py::array to_array(const py::object& object, const std::string& name, const char* expected) {
  if (!py::isinstance<py::array>(object)) throw InvalidInput(name + " must be a NumPy array, " + expected);
  return py::reinterpret_borrow<py::array>(object);
}

[[noreturn]] void wrong_shape(const py::array& array, const std::string& name, const char* expected) {
  throw InvalidInput(name + " must have shape " + expected + ", not " + shape_of(array));
}

[[noreturn]] void wrong_type(const py::array& array, const std::string& name, const char* expected) {
  throw InvalidInput(name + " must be " + expected + ", not " + std::string(py::str(array.dtype())));
}

/// Returns any integer array as int64 in C order.
py::array_t<std::int64_t, py::array::c_style | py::array::forcecast> to_integers(const py::array& array,
                                                                                 const std::string& name) {
  const char kind = array.dtype().kind();
  if (kind != 'i' && kind != 'u') wrong_type(array, name, "an integer array");
  return py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>(array);
}

std::uint32_t to_index(std::int64_t value, py::ssize_t row, const std::string& name) {
  // No index is the highest number, because that is kNone.
  if (value < 0 || value >= std::numeric_limits<std::uint32_t>::max()) {
    std::ostringstream text;
    text << name << "[" << row << "] has the index " << value << ", which is out of range";
    throw InvalidInput(text.str(), "invalid_mesh");
  }
  return static_cast<std::uint32_t>(value);
}

}  // namespace

Storage require_vertices(const py::object& object, const std::string& name) {
  const py::array array = to_array(object, name, "(n, 3) float32 or float64");
  const bool single = py::isinstance<py::array_t<float>>(array);
  if (!single && !py::isinstance<py::array_t<double>>(array)) wrong_type(array, name, "float32 or float64");
  if (array.ndim() != 2 || array.shape(1) != 3) wrong_shape(array, name, "(n, 3)");
  if (array.shape(0) >= std::numeric_limits<std::int32_t>::max())
    throw InvalidInput(name + " has more than 2^31 - 1 rows");
  return single ? Storage::float32 : Storage::float64;
}

Vertices to_vertices(const py::object& object, const std::string& name) {
  Vertices result;
  result.storage = require_vertices(object, name);
  const auto array = py::reinterpret_borrow<py::array>(object);
  result.values.resize(static_cast<std::size_t>(array.shape(0)));
  const auto copy = [&](const auto& view) {
    for (py::ssize_t i = 0; i < view.shape(0); ++i) {
      result.values[static_cast<std::size_t>(i)] = {view(i, 0), view(i, 1), view(i, 2)};
    }
  };
  if (result.storage == Storage::float32) {
    copy(py::array_t<float>(array).unchecked<2>());
  } else {
    copy(py::array_t<double>(array).unchecked<2>());
  }
  return result;
}

std::vector<glm::uvec3> to_triangles(const py::object& object, const std::string& name) {
  const py::array array = to_array(object, name, "(m, 3) integers");
  if (array.ndim() != 2 || array.shape(1) != 3) wrong_shape(array, name, "(m, 3)");
  const auto integers = to_integers(array, name);
  const auto view = integers.unchecked<2>();
  std::vector<glm::uvec3> result(static_cast<std::size_t>(view.shape(0)));
  for (py::ssize_t i = 0; i < view.shape(0); ++i) {
    for (int k = 0; k < 3; ++k) result[static_cast<std::size_t>(i)][k] = to_index(view(i, k), i, name);
  }
  return result;
}

std::vector<std::uint32_t> to_faces(const py::object& object, const std::string& name, int& corners) {
  const py::array array = to_array(object, name, "(m, k) integers, k from 1 to 4");
  if (array.ndim() != 2 || array.shape(1) < 1 || array.shape(1) > 4) wrong_shape(array, name, "(m, k), k from 1 to 4");
  const auto integers = to_integers(array, name);
  const auto view = integers.unchecked<2>();
  corners = static_cast<int>(view.shape(1));
  std::vector<std::uint32_t> result;
  result.reserve(static_cast<std::size_t>(view.size()));
  for (py::ssize_t i = 0; i < view.shape(0); ++i) {
    for (py::ssize_t k = 0; k < view.shape(1); ++k) result.push_back(to_index(view(i, k), i, name));
  }
  return result;
}

std::vector<std::int32_t> to_labels(const py::object& object, const std::string& name) {
  const py::array array = to_array(object, name, "(n,) integers");
  const auto integers = to_integers(array, name);
  std::vector<std::int32_t> result;
  result.reserve(static_cast<std::size_t>(integers.size()));
  const std::int64_t* data = integers.data();
  for (py::ssize_t i = 0; i < integers.size(); ++i) {
    if (data[i] < std::numeric_limits<std::int32_t>::min() || data[i] > std::numeric_limits<std::int32_t>::max()) {
      throw InvalidInput(name + " has a label that does not fit 32 bits");
    }
    result.push_back(static_cast<std::int32_t>(data[i]));
  }
  return result;
}

unsigned to_threads(std::optional<int> threads) {
  if (threads && *threads < 1) throw InvalidInput("threads must be at least 1, or None for one per core");
  return static_cast<unsigned>(threads.value_or(0));
}

glm::dmat4 to_matrix(const py::object& object, const std::string& name) {
  if (object.is_none()) return glm::dmat4(1);
  const py::array_t<double, py::array::c_style | py::array::forcecast> array(object);
  if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4) wrong_shape(array, name, "(4, 4)");
  const auto view = array.unchecked<2>();
  glm::dmat4 result;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) result[column][row] = view(row, column);
  }
  return result;
}

TriangleMesh to_mesh(const py::object& vertices, const py::object& triangles, const std::string& suffix) {
  return {to_vertices(vertices, "vertices" + suffix).values, to_triangles(triangles, "triangles" + suffix)};
}

Outside to_outside(const std::string& outside) {
  if (outside == "error") return Outside::error;
  if (outside == "keep") return Outside::keep;
  throw InvalidInput("outside must be \"error\" or \"keep\", not \"" + outside + "\"");
}

PullBack::Crossings to_crossings(const std::string& crossings) {
  if (crossings == "keep_out") return PullBack::Crossings::keep_out;
  if (crossings == "allow") return PullBack::Crossings::allow;
  throw InvalidInput("crossings must be \"keep_out\" or \"allow\", not \"" + crossings + "\"");
}

py::object from_normals(const std::optional<Normals>& normals) {
  if (!normals) return py::none();
  py::dict result;
  result["largest"] = normals->largest;
  result["unsure"] = normals->unsure;
  result["exceeded_before"] = normals->exceeded_before, result["exceeded_after"] = normals->exceeded_after;
  return result;
}

py::dict from_outside(const FaceCount& outside, const FaceCount& uncovered) {
  py::dict entry;
  entry["faces"] = outside.faces;
  entry["first"] = outside.first ? py::object(py::int_(*outside.first)) : py::object(py::none());
  entry["reference_faces"] = uncovered.faces;
  return entry;
}

py::array from_vertices(const std::vector<glm::dvec3>& values, Storage storage) {
  const auto fill = [&](auto array) -> py::array {
    auto view = array.template mutable_unchecked<2>();
    for (std::size_t i = 0; i < values.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        view(static_cast<py::ssize_t>(i), k) = static_cast<std::remove_reference_t<decltype(view(0, 0))>>(values[i][k]);
      }
    }
    return array;
  };
  const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(values.size()), 3};
  return storage == Storage::float32 ? fill(py::array_t<float>(shape)) : fill(py::array_t<double>(shape));
}

py::array_t<std::int32_t> from_triangles(const std::vector<glm::uvec3>& values) {
  py::array_t<std::int32_t> array({static_cast<py::ssize_t>(values.size()), py::ssize_t{3}});
  auto view = array.mutable_unchecked<2>();
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (int k = 0; k < 3; ++k) view(static_cast<py::ssize_t>(i), k) = static_cast<std::int32_t>(values[i][k]);
  }
  return array;
}

}  // namespace tolvol::python
