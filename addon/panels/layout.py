# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts that the panels share: their place in the interface, text that fits the sidebar, and coloured icons."""

import blf
import bpy

from .. import native
from ..operators import blocked
from ..operators.original import active

_FONT = 0  # Blender's own
# Pixels of the sidebar's width that tabs, margins and the icon take from the text of a label.
_BESIDE_TEXT = 85
# Pixels that tabs and margins take from the width of a box, and that a label takes from its text.
_BESIDE_BOX, _BESIDE_LABEL = 64, 4
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


def right(layout, text):
    row = layout.row()
    row.alignment = "RIGHT"
    row.label(text=text)


def is_narrow(context):
    """Whether the sidebar has no room for a length beside its percentage."""
    return context.region.width < _NARROW * context.preferences.system.ui_scale


def _room(context):
    """Sets the font of the panels. Returns how many pixels a text may be wide."""
    scale = context.preferences.system.ui_scale
    blf.size(_FONT, context.preferences.ui_styles[0].widget.points * scale)
    return max(context.region.width, 100) - _BESIDE_TEXT * scale


def fitting(context, *texts, share=None):
    """Returns the first of the texts that fits the sidebar, or the last.

    share: the part of a box's width that is for the text, if a name stands beside it.
    """
    room = _room(context)
    if share is not None:
        scale = context.preferences.system.ui_scale
        room = share * (max(context.region.width, 100) - _BESIDE_BOX * scale) - _BESIDE_LABEL * scale
    return next((text for text in texts if blf.dimensions(_FONT, text)[0] <= room), texts[-1])


def wrapped(context, text):
    """Returns the text as lines that fit the sidebar."""
    room, lines = _room(context), [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and blf.dimensions(_FONT, longer)[0] > room:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def text_lines(context, layout, text, icon):
    """Draws a label, broken into lines that fit the sidebar."""
    column = layout.column(align=True)
    for i, line in enumerate(wrapped(context, text)):
        column.label(text=line, icon="BLANK1" if i else icon)


def say_blocked(context, layout, ob):
    """Says why the mesh cannot be changed, unless the reason is the reference or the mode: other panels say that."""
    reason = blocked.decimate_blocked(ob)
    if reason and reason not in (blocked.object_blocked(ob), blocked.reference_blocked(ob), blocked.check_blocked(ob)):
        text_lines(context, layout, reason, "ERROR")
