// SPDX-License-Identifier: GPL-3.0-or-later
/// The Python class ToleranceVolume holds this.
#pragma once

#include "check/tolerance_volume.h"

namespace tolvol::python {

struct Volume {
  ToleranceVolume native;
  std::size_t vertices, triangles;
  double seconds = 0;  ///< to build
};

}  // namespace tolvol::python
