# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

from ..files.gltf_extras import GEOMETRIC_ERROR
from ..mesh.mesh_io import triangle_count
from ..operators.lod import chain, draw_lod_settings
from ..proof import verdict
from ..units import length
from .layout import SubPanel, active, is_narrow, right


class TOLVOL_PT_lod(SubPanel, bpy.types.Panel):
    """The settings of the levels of detail, and the levels that were made last."""

    bl_label = "LOD Chain"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        made = chain(active(context))
        settings = made[0].tolvol.lod
        draw_lod_settings(layout, settings)
        layout.operator("tolvol.make_lods")
        # Each level has its rows before it is made, so that no panel below moves.
        column = layout.column(align=True)
        for i in range(max(settings.levels + 1, len(made))):
            _draw_level(context, column, made, i)


_NAME = 0.36  # the part of a row that is for the name of a level


def _draw_level(context, column, made, i):
    """Draws the name of a level, its triangles and its deviation, which has a row of its own in a narrow sidebar."""
    narrow = is_narrow(context)
    row = column.row() if narrow or not i else column.split(factor=_NAME)
    if i < len(made):
        level = made[i]
        button = row.row()
        button.alignment, button.enabled = "LEFT", len(made) > 1
        icon = "HIDE_OFF" if level.visible_get() else "HIDE_ON"
        name = level.name.removeprefix(f"{made[0].name}_")
        button.operator("tolvol.show_level", text=name, icon=icon, emboss=False).level = i
        triangles = f"{triangle_count(level.data):,}" if level.type == "MESH" else ""
        deviation = _deviation(context, level, i)
    else:
        row.label(text=f"LOD{i}", icon="HIDE_ON")
        triangles, deviation = "", "\u2013"
    if narrow:
        right(row, triangles)
        right(column, deviation)
    elif not i:
        # The object itself, which is the first level, may have a long name: the numbers have a row of their own.
        right(column, f"{triangles}  {deviation}")
    else:
        # Two labels would leave each other too little room.
        right(row, f"{triangles}  {deviation}")


def _deviation(context, level, i):
    """Returns the proved deviation as text. That of the object itself is known after a measurement."""
    error = level.get(GEOMETRIC_ERROR)
    if not i:
        found = verdict.of(level) if level.type == "MESH" else None
        error = found.largest if found else None
        if found and verdict.negligible(found.largest, found.tolerance):
            return "almost 0"
    return length(context, error) if isinstance(error, float) else "\u2013"
