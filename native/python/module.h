// SPDX-License-Identifier: GPL-3.0-or-later
/// Each of these functions adds the classes and functions of one part to the module.
#pragma once

#include <pybind11/pybind11.h>

namespace tolvol::python {

void bind_errors(pybind11::module_& module);
void bind_progress(pybind11::module_& module);
void bind_worker(pybind11::module_& module);
void bind_gl(pybind11::module_& module);
void bind_volume(pybind11::module_& module);
void bind_display(pybind11::module_& module);
void bind_constrain(pybind11::module_& module);
void bind_smoothing(pybind11::module_& module);
void bind_decimation(pybind11::module_& module);
void bind_deformation(pybind11::module_& module);
void bind_measure(pybind11::module_& module);
void bind_topology(pybind11::module_& module);
void bind_repair(pybind11::module_& module);
void bind_list_rows(pybind11::module_& module);
void bind_picture(pybind11::module_& module);

}  // namespace tolvol::python
