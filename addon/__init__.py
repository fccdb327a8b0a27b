# SPDX-License-Identifier: GPL-3.0-or-later
"""Tolerance Volumes: keep a mesh within a tolerance of a reference surface."""

import sys

bl_info = {
    "name": "Tolerance Volumes",
    "author": "The Tolerance Volumes authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Tolerance",
    "description": "Decimate a mesh within a tolerance of its original, proved in both directions",
    "category": "Mesh",
}

# When a new version is installed over this one, Blender reloads this file alone. The submodules are forgotten here, so
# that the imports below load them anew.
for _name in [name for name in sys.modules if name.startswith(__name__ + ".")]:
    del sys.modules[_name]
    globals().pop(_name.removeprefix(__name__ + "."), None)

from . import (  # noqa: E402
    background,
    estimate,
    guard,
    job,
    measuring,
    native,
    operators,
    overlay,
    panels,
    preferences,
    properties,
    reference,
)
from .files.gltf_extras import glTF2ExportUserExtension  # noqa: E402, F401  Blender's exporter of glTF looks for it here.

_PARTS = (background, preferences, properties, reference, job, operators, guard, overlay, measuring, estimate, panels)


def register():
    for part in _PARTS:
        part.register()


def unregister():
    for part in reversed(_PARTS):
        part.unregister()
    native.shutdown()
