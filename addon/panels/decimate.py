# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

from ..operators.decimate import draw_advanced_settings, draw_decimate_settings, draw_protect_settings, targets
from .layout import SubPanel, active


class TOLVOL_PT_decimate(SubPanel, bpy.types.Panel):
    bl_label = "Decimate"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        ob = active(context)
        draw_decimate_settings(layout, ob.tolvol)
        count = len(targets(context))
        layout.operator("tolvol.decimate", text=f"Decimate {count} Objects" if count > 1 else "Decimate")


class TOLVOL_PT_protect(SubPanel, bpy.types.Panel):
    bl_label = "Protect"
    bl_parent_id = "TOLVOL_PT_decimate"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        draw_protect_settings(context, layout, active(context).tolvol, active(context))


class TOLVOL_PT_advanced(SubPanel, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "TOLVOL_PT_decimate"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        draw_advanced_settings(context, layout, active(context).tolvol)
