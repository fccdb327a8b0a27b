// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/module.h"

#include <string>

namespace {

// NumPy 2 moved fields that an older pybind11 reads, so that pybind11 would take wrong sizes without an error.
void refuse_newer_numpy() {
#if PYBIND11_VERSION_HEX < 0x020C0000
  const auto version = pybind11::module_::import("numpy").attr("__version__").cast<std::string>();
  if (std::stoi(version) >= 2) {
    throw pybind11::import_error("made for NumPy 1, and this is NumPy " + version +
                                 ": build it with pybind11 2.12 or later, as -DTOLVOL_PYTHONS does");
  }
#endif
}

// An object that __new__ made without __init__ holds nothing. If a call needs its value, pybind11 would allocate the
// value and leave it uninitialised. pybind11 asks the class for the memory, and this function refuses.
void* refuse_uninitialised(std::size_t) {
  throw pybind11::type_error(
      "this object was never initialised: make one by calling its class, or the function that "
      "returns it");
}

void refuse_uninitialised_objects(const pybind11::module_& module) {
  for (const auto& entry : module.attr("__dict__").cast<pybind11::dict>()) {
    if (!PyType_Check(entry.second.ptr())) continue;
    auto* const type = reinterpret_cast<PyTypeObject*>(entry.second.ptr());
    if (auto* const info = pybind11::detail::get_type_info(type)) info->operator_new = refuse_uninitialised;
  }
}

}  // namespace

PYBIND11_MODULE(_native, module) {
  refuse_newer_numpy();
  module.doc() = "The compiled part of the package tolvol.";
  // Classes, errors and signatures take their module's name from here, because users know only the package.
  const pybind11::object name = module.attr("__name__");
  module.attr("__name__") = "tolvol";
  module.attr("__version__") = TOLVOL_VERSION;
  tolvol::python::bind_errors(module);
  tolvol::python::bind_progress(module);
  tolvol::python::bind_worker(module);
  tolvol::python::bind_gl(module);
  tolvol::python::bind_volume(module);
  tolvol::python::bind_display(module);
  tolvol::python::bind_constrain(module);
  tolvol::python::bind_smoothing(module);
  tolvol::python::bind_decimation(module);
  tolvol::python::bind_deformation(module);
  tolvol::python::bind_measure(module);
  tolvol::python::bind_topology(module);
  tolvol::python::bind_repair(module);
  tolvol::python::bind_list_rows(module);
  tolvol::python::bind_picture(module);
  refuse_uninitialised_objects(module);
  module.attr("__name__") = name;
}
