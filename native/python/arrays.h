// SPDX-License-Identifier: GPL-3.0-or-later
/// Converts NumPy arrays and checks their dtype, shape and index range. Errors name the argument and the form that it
/// should have.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "base/errors.h"
#include "check/outside.h"
#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"
#include "motion/pull_back.h"

namespace tolvol::python {

namespace py = pybind11;

/// Takes an (n, 3) array of float32 or float64.
struct Vertices {
  std::vector<glm::dvec3> values;
  Storage storage;
};
Vertices to_vertices(const py::object& array, const std::string& name);
/// Throws like to_vertices(), copies nothing, and returns the number type.
Storage require_vertices(const py::object& array, const std::string& name);

/// Takes an (m, 3) array of any integer type. This refuses negative values; the native validation refuses large values.
std::vector<glm::uvec3> to_triangles(const py::object& array, const std::string& name);

/// Takes both. `suffix` ends the names of the arguments, as in "vertices_a".
TriangleMesh to_mesh(const py::object& vertices, const py::object& triangles, const std::string& suffix = "");

/// Takes an (m, k) array of any integer type, k from 1 to 4, and returns it flat. Sets `corners` to k.
std::vector<std::uint32_t> to_faces(const py::object& array, const std::string& name, int& corners);

/// Takes an (n,) array of any integer type.
std::vector<std::int32_t> to_labels(const py::object& array, const std::string& name);

/// Takes an (n,) array of exactly this type, double or bool, with a value for each of n vertices, and returns it in C
/// order.
template <class T>
py::array_t<T, py::array::c_style> to_vertex_values(const py::object& array, const std::string& name, std::size_t n) {
  const std::string type = std::is_same_v<T, bool> ? "bool" : "float64";
  if (!py::isinstance<py::array_t<T>>(array) || py::reinterpret_borrow<py::array>(array).ndim() != 1) {
    throw InvalidInput(name + " must be a " + type + " array, one value for each vertex");
  }
  py::array_t<T, py::array::c_style> values(py::reinterpret_borrow<py::array>(array));
  if (static_cast<std::size_t>(values.size()) != n) throw InvalidInput(name + " must have one value for each vertex");
  return values;
}

Outside to_outside(const std::string& outside);
PullBack::Crossings to_crossings(const std::string& crossings);

/// The entry "outside" of a report.
py::dict from_outside(const FaceCount& outside, const FaceCount& uncovered);
/// Returns a dict, or None where no angle was kept.
py::object from_normals(const std::optional<Normals>& normals);

/// Returns 0, which means one for each core, for None. Throws InvalidInput below 1.
unsigned to_threads(std::optional<int> threads);

/// Takes a (4, 4) array, row-major as NumPy writes it. None is the identity.
glm::dmat4 to_matrix(const py::object& array, const std::string& name = "to_world");

py::array from_vertices(const std::vector<glm::dvec3>& values, Storage storage);
py::array_t<std::int32_t> from_triangles(const std::vector<glm::uvec3>& values);

template <class T, class U>
py::array_t<T> from_vector(const std::vector<U>& values) {
  py::array_t<T> array(static_cast<py::ssize_t>(values.size()));
  T* out = array.mutable_data();
  for (std::size_t i = 0; i < values.size(); ++i) out[i] = static_cast<T>(values[i]);
  return array;
}

}  // namespace tolvol::python
