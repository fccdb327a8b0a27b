# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

from ..operators.smooth import draw_smooth_settings
from .layout import SubPanel, active


class TOLVOL_PT_smooth(SubPanel, bpy.types.Panel):
    bl_label = "Smooth"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        ob = active(context)
        draw_smooth_settings(context, layout, ob.tolvol.smooth, ob)
        layout.operator("tolvol.smooth", text="Smooth")
