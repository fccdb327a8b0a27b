# SPDX-License-Identifier: GPL-3.0-or-later
"""Declares what the panel shows and the .blend file keeps: the properties at Object.tolvol (object.py).

Settings that belong to one operation are declared in operation_settings.py.
"""

import bpy

from .choices import (
    TOLERANCE_UNITS,
    automatic_placement,
    deform_mode_setting,
    placement_setting,
    tolerance_settings,
)
from .measured import TOLVOL_PG_label, TOLVOL_PG_measurement
from .object import (
    TOLVOL_PG_bake,
    TOLVOL_PG_guard,
    TOLVOL_PG_lod,
    TOLVOL_PG_modifiers,
    TOLVOL_PG_settings,
    TOLVOL_PG_smooth,
)

__all__ = [
    "TOLERANCE_UNITS",
    "automatic_placement",
    "deform_mode_setting",
    "placement_setting",
    "register",
    "tolerance_settings",
    "unregister",
]

_CLASSES = (
    TOLVOL_PG_measurement,
    TOLVOL_PG_label,
    TOLVOL_PG_smooth,
    TOLVOL_PG_modifiers,
    TOLVOL_PG_lod,
    TOLVOL_PG_bake,
    TOLVOL_PG_guard,
    TOLVOL_PG_settings,
)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Object.tolvol = bpy.props.PointerProperty(type=TOLVOL_PG_settings)


def unregister():
    del bpy.types.Object.tolvol
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
