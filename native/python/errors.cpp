// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/errors.h"

#include "python/module.h"

namespace tolvol::python {
namespace {

namespace py = pybind11;

constexpr const char* kDescription = R"doc(The base of all errors that the package raises.

Attributes
----------
code : str
    A short name of the reason, which stays the same from version to version. The text of an error is for people and may
    change.

    "invalid_argument" : the type, the shape or the value of an argument is wrong
    "invalid_mesh" : a mesh is empty or without extent, a coordinate is not finite, or an index is out of range
    "invalid_transform" : to_world is not finite, not affine or singular
    "tolerance_too_large" : the tolerance is larger than the reference
    "tolerance_too_small" : the tolerance is too small for the rounding of these coordinates
    "too_far" : a place is too far away for double precision
    "input_outside" : faces of the input are not within the tolerance of the reference
    "reference_outside" : faces of the reference are not within the tolerance of the input
    "too_large" : the work would exceed a limit of memory
    "gl_unavailable" : there is no OpenGL 4.5, or it failed
    "cancelled" : the call was stopped through its Progress
count, first : int or None
    With "input_outside" and "reference_outside" the number of these faces and the index of the first one.)doc";

py::exception<void> make(py::module_& module, const char* name, const py::handle& base, const char* code,
                         const char* description) {
  py::exception<void> made(module, name, base);
  made.attr("__doc__") = description;
  made.attr("code") = code;
  return made;
}

/// Sets `error` as the Python exception `type`.
void set(const py::object& type, const Error& error) {
  const py::object made = type(error.what());
  made.attr("code") = error.code;
  if (const auto* const outside = dynamic_cast<const FacesOutside*>(&error)) {
    made.attr("count") = outside->count;
    made.attr("first") = outside->first;
  }
  PyErr_SetObject(type.ptr(), made.ptr());
}

}  // namespace

void bind_errors(py::module_& module) {
  static auto base = make(module, "TolvolError", PyExc_Exception, "error", kDescription);
  base.attr("count") = py::none();
  base.attr("first") = py::none();
  static auto invalid_input = make(module, "InvalidInput", py::make_tuple(base, py::handle(PyExc_ValueError)),
                                   "invalid_argument", "An argument is wrong. The message names the first offender.");
  static auto resource_limit = make(module, "ResourceLimit", base, "too_large",
                                    "The work would exceed a limit of memory. The message names a setting that fits.");
  static auto gl_unavailable = make(module, "GlUnavailable", base, "gl_unavailable",
                                    "There is no OpenGL 4.5 here, or it failed on the way. The message says why.");
  static auto cancelled =
      make(module, "Cancelled", base, "cancelled", "The call was stopped by the method cancel of its Progress.");
  // This is local to the module, because a second copy of it in the same process has classes of its own.
  py::register_local_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const InvalidInput& error) {
      set(invalid_input, error);
    } catch (const ResourceLimit& error) {
      set(resource_limit, error);
    } catch (const GlUnavailable& error) {
      set(gl_unavailable, error);
    } catch (const Cancelled& error) {
      // After a signal, the exception of its handler is already set.
      if (!PyErr_Occurred()) set(cancelled, error);
    }
  });
}

}  // namespace tolvol::python
