# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the job under way where nothing moves when it begins or ends: in rows that are there without it, too."""

import bpy

from ..wrapping import fitting

_HAS_BAR = hasattr(bpy.types.UILayout, "progress")  # from Blender 4.0 on


def draw_progress(context, box, told):
    """Draws the job in place of a verdict, in as many rows."""
    row = box.row()
    row.scale_y = 1.5
    row.label(text=_name(told), icon="SORTTIME")
    column = box.column(align=True)
    if told.share is None:
        column.label(text=told.stage)
    else:
        done = f"{told.stage} ({told.share:.0%})"
        text = fitting(context, *([f"{done}, {told.left}"] if told.left else []), done)
        if _HAS_BAR:
            column.progress(factor=told.share, text=text)
        else:
            column.label(text=text)
    column.label(text=fitting(context, told.count, ", ".join(told.count.split(", ")[:2])))
    column.label(text=f"Esc: {told.escape}" if told.escape else "")


def in_a_row(context, told):
    """Returns in few words what is at work, and how far it is."""
    name, far = _name(told), told.stage if told.share is None else f"{told.share:.0%}"
    return fitting(context, f"{name}: {far}", far)


def _name(told):
    """Returns the name of what is at work, without the words for which the panel has no room."""
    return told.part or told.title.removesuffix(" in Tolerance").removesuffix(" to Tolerance")
