# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

from ..operators.modifiers import FITTED, modifier_blocked
from .layout import SubPanel, active, say_blocked, text_lines


class TOLVOL_PT_modifiers(SubPanel, bpy.types.Panel):
    bl_label = "Modifiers"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        ob = active(context)
        if not ob.modifiers:
            layout.label(text="No modifiers", icon="INFO")
            return
        column = layout.column()
        column.use_property_split = True
        column.use_property_decorate = False
        column.prop(ob.tolvol.modifiers, "result")
        icons = bpy.types.Modifier.bl_rna.properties["type"].enum_items
        for modifier in ob.modifiers:
            reason = modifier_blocked(ob, modifier)
            row = layout.split(factor=0.68)
            row.label(text=modifier.name, icon=icons[modifier.type].icon)
            button = row.row()
            button.enabled = not reason
            fits = modifier.type in FITTED
            name, text = ("fit_modifier", "Fit") if fits else ("apply_modifier", "Apply")
            button.operator(f"tolvol.{name}", text=text).modifier = modifier.name
            if reason:
                text_lines(context, layout, reason, "BLANK1")
        say_blocked(context, layout, ob)
