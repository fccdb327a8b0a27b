// SPDX-License-Identifier: GPL-3.0-or-later
#include "baselines/module.h"

PYBIND11_MODULE(tolvol_baselines, module) {
  module.doc() = "Other methods in the same process, for benchmarks only.";
  tolvol::baselines::bind_decimation(module);
  tolvol::baselines::bind_openmesh(module);
  tolvol::baselines::bind_permission_grid(module);
}
