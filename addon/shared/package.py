# SPDX-License-Identifier: GPL-3.0-or-later
"""The package `tolvol` that this folder calls, as `module`.

In the package that pip installs it is the package around this folder. In Blender it is the private copy that
addon/native.py loads and puts here; it is None where no copy can be loaded.
"""

import sys

_around = sys.modules.get(__package__.rpartition(".")[0])
module = _around if hasattr(_around, "ToleranceVolume") else None
