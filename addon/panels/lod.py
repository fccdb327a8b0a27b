# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

from ..files.gltf_extras import GEOMETRIC_ERROR
from ..operators.lod import draw_lod_settings
from ..units import length
from .layout import SubPanel, active, right


class TOLVOL_PT_lod(SubPanel, bpy.types.Panel):
    """The settings of the levels of detail, and the levels that were made last."""

    bl_label = "LOD Chain"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        ob = active(context)
        draw_lod_settings(layout, ob.tolvol.lod)
        layout.operator("tolvol.make_lods")
        # Each level has its row before it is made, so that no panel below moves.
        column, made = layout.column(align=True), ob.tolvol.lods.objects[:] if ob.tolvol.lods else []
        for i in range(max(ob.tolvol.lod.levels, len(made))):
            row = column.row()
            if i >= len(made):
                row.label(text=f"LOD{i + 1}")
                right(row, "\u2013")
                continue
            level = made[i]
            row.label(text=level.name.removeprefix(f"{ob.name}_"))
            right(row, f"{len(level.data.polygons):,}" if level.type == "MESH" else "")
            error = level.get(GEOMETRIC_ERROR)
            right(row, length(context, error) if isinstance(error, float) else "")
