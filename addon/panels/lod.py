# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

from ..files.gltf_extras import GEOMETRIC_ERROR
from ..mesh.mesh_io import triangle_count
from ..operators.lod import chain, draw_lod_settings
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
        made = chain(active(context))
        settings = made[0].tolvol.lod
        draw_lod_settings(layout, settings)
        layout.operator("tolvol.make_lods")
        # Each level has its row before it is made, so that no panel below moves.
        column = layout.column(align=True)
        for i in range(max(settings.levels + 1, len(made))):
            row = column.row()
            if i >= len(made):
                row.label(text=f"LOD{i}", icon="HIDE_ON")
                right(row, "\u2013")
                continue
            level = made[i]
            button = row.row()
            button.alignment, button.enabled = "LEFT", len(made) > 1
            icon = "HIDE_OFF" if level.visible_get() else "HIDE_ON"
            name = level.name.removeprefix(f"{made[0].name}_")
            button.operator("tolvol.show_level", text=name, icon=icon, emboss=False).level = i
            right(row, f"{triangle_count(level.data):,}" if level.type == "MESH" else "")
            error = level.get(GEOMETRIC_ERROR)
            right(row, length(context, error) if isinstance(error, float) else "\u2013")
