# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts that the panels share: their place in the interface, and coloured icons."""

import bpy

from .. import native
from ..operators.original import active

# Pixels of the sidebar's width, tabs included, below which a row has room for one number.
_NARROW = 215

GREY = "RADIOBUT_OFF"
# Blender's icons of coloured squares have other names in newer versions.
_ICONS = bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
_COLOR = "SEQUENCE_COLOR" if "SEQUENCE_COLOR_01" in _ICONS else "STRIP_COLOR"
GHOST = "GHOST_ENABLED" if "GHOST_ENABLED" in _ICONS else "NONE"
RED, AMBER, GREEN = f"{_COLOR}_01", f"{_COLOR}_02", f"{_COLOR}_04"


class Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Tolerance"


class SubPanel(Panel):
    bl_parent_id = "TOLVOL_PT_tolerance"

    @classmethod
    def poll(cls, context):
        ob = active(context)
        return native.module is not None and ob is not None and ob.type == "MESH"


_most_rows = {}  # (name of a panel, width of the sidebar) -> the most rows that it has had


def keep_height(context, column, name, rows):
    """Fills a column of `rows` rows up to as many as the panel has had: if a sidebar that is scrolled to its end became
    shorter, Blender would move all that is above.

    column: an aligned one.
    """
    most = _most_rows.get((name, context.region.width), 0)
    _most_rows[name, context.region.width] = max(most, rows)
    for _ in range(most - rows):
        column.label()


def right(layout, text):
    row = layout.row()
    row.alignment = "RIGHT"
    row.label(text=text)


def is_narrow(context):
    """Whether the sidebar has no room for a length beside its percentage."""
    return context.region.width < _NARROW * context.preferences.system.ui_scale
