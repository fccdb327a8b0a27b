// SPDX-License-Identifier: GPL-3.0-or-later
/// One function per baseline; each adds its functions to the module.
#pragma once

#include <pybind11/pybind11.h>

namespace tolvol::baselines {

void bind_decimation(pybind11::module_& module);
void bind_openmesh(pybind11::module_& module);
void bind_permission_grid(pybind11::module_& module);

}  // namespace tolvol::baselines
