// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace tolvol::baselines {

void bind_permission_grid(pybind11::module_& module);

}  // namespace tolvol::baselines
