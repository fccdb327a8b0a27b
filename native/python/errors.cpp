// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/errors.h"

#include "python/module.h"

namespace tolvol::python {

void bind_errors(pybind11::module_& module) {
  namespace py = pybind11;
  static py::exception<void> base(module, "TolvolError");
  const py::tuple also_value_error = py::make_tuple(base, py::handle(PyExc_ValueError));
  static py::exception<InvalidInput> invalid_input(module, "InvalidInput", also_value_error);
  static py::exception<ResourceLimit> resource_limit(module, "ResourceLimit", base);
  static py::exception<GlUnavailable> gl_unavailable(module, "GlUnavailable", base);
  static py::exception<Cancelled> cancelled(module, "Cancelled", base);
  // Module-local: a second copy of the module in the same process must not translate with the classes of the first.
  py::register_local_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const InvalidInput& error) {
      PyErr_SetString(invalid_input.ptr(), error.what());
    } catch (const ResourceLimit& error) {
      PyErr_SetString(resource_limit.ptr(), error.what());
    } catch (const GlUnavailable& error) {
      PyErr_SetString(gl_unavailable.ptr(), error.what());
    } catch (const Cancelled& error) {
      // After a signal the exception of its handler is set already.
      if (!PyErr_Occurred()) PyErr_SetString(cancelled.ptr(), error.what());
    }
  });
}

}  // namespace tolvol::python
