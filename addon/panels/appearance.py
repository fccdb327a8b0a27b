# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

from ..wrapping import property_fields
from .layout import SubPanel, active, is_narrow


class TOLVOL_PT_appearance(SubPanel, bpy.types.Panel):
    """What makes the few faces of a decimated mesh look like the original."""

    bl_label = "Appearance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = active(context).tolvol.bake
        layout.operator("tolvol.shade_by_reference", text="Shade by Reference")
        column = layout.column(align=True)
        property_fields(context, column, settings, "image_size")
        row = column.row()
        row.use_property_split = not is_narrow(context)
        row.prop(settings, "shade")
        column.operator("tolvol.bake_normals")
