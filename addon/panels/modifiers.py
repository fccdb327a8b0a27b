# SPDX-License-Identifier: GPL-3.0-or-later
import bpy

from ..operators.modifiers import FITTED, modifier_blocked
from ..wrapping import property_fields, text_lines
from .layout import SubPanel, active


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
        property_fields(context, column, ob.tolvol.modifiers, "result")
        icons = bpy.types.Modifier.bl_rna.properties["type"].enum_items
        reasons = {modifier.name: modifier_blocked(ob, modifier) for modifier in ob.modifiers}
        for modifier in ob.modifiers:
            row = layout.split(factor=0.68)
            row.label(text=modifier.name, icon=icons[modifier.type].icon)
            button = row.row()
            button.enabled = not reasons[modifier.name]
            fits = modifier.type in FITTED
            name, text = ("fit_modifier", "Fit") if fits else ("apply_modifier", "Apply")
            button.operator(f"tolvol.{name}", text=text).modifier = modifier.name
        # The sentences are below all buttons, so that they move none.
        for name, reason in reasons.items():
            if reason:
                text_lines(context, layout, f"{name}: {reason}", "INFO")
