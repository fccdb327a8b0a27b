# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

from ..wrapping import property_fields
from .layout import SubPanel, active


class TOLVOL_PT_deform(SubPanel, bpy.types.Panel):
    bl_label = "Deform"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = active(context).tolvol
        layout.prop(settings, "lattice")
        property_fields(context, layout, settings, "deform_mode")
        layout.operator("tolvol.deform", text="Deform")
